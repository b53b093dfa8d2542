//! Endpoints and certificate from the command line.

use std::path::PathBuf;

use crate::endpoint::{EndpointError, endpoint};

/// Endpoints from the command line.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct NetworkFlags {
    /// Listen on this endpoint too, e.g. `tcp/127.0.0.1:7447`; may be repeated
    #[arg(long, value_name = "ENDPOINT", value_parser = well_formed)]
    pub listen: Vec<String>,
    /// Connect to this endpoint too; may be repeated
    #[arg(long, value_name = "ENDPOINT", value_parser = well_formed)]
    pub connect: Vec<String>,
    /// Authenticate with the certificate in this directory, made by `trusswatch pki issue`, and
    /// accept nothing but mutually authenticated TLS
    #[arg(long, value_name = "DIRECTORY")]
    pub tls: Option<PathBuf>,
}

fn well_formed(text: &str) -> Result<String, EndpointError> {
    endpoint(text).map(|_| text.to_owned())
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Debug, Parser)]
    struct Program {
        #[command(flatten)]
        network: NetworkFlags,
    }

    #[test]
    fn a_flag_that_is_no_endpoint_is_named() {
        for (flag, text, wrong) in [
            ("--listen", "nowhere", "`nowhere` is no endpoint"),
            ("--connect", "tpc/host:7447", "`tpc/host:7447` is an endpoint of no known protocol"),
        ] {
            let error = Program::try_parse_from(["p", flag, text]).unwrap_err();
            assert_eq!(error.exit_code(), 2);
            let error = error.to_string();
            assert!(error.contains(flag) && error.contains(wrong), "{error}");
        }
        let read = Program::try_parse_from(["p", "--listen", "tcp/127.0.0.1:7447"]).unwrap();
        assert_eq!(read.network.listen, ["tcp/127.0.0.1:7447"]);
    }
}
