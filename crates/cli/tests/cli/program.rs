//! The one file under the names of the other programs.

use std::os::unix::process::CommandExt;

use crate::binary::trusswatch;

#[test]
fn it_is_the_program_by_whose_name_it_is_called() {
    for (name, about) in [
        ("trusswatch-diagnoser", "Fault diagnosis of one module"),
        ("/bin/trusswatch-plant", "The simulated tower"),
        ("trusswatch", "Distributed fault diagnosis"),
    ] {
        let output = trusswatch().arg0(name).arg("--help").output().unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        assert!(output.status.success() && text.contains(about), "{name}: {text}");
    }
}
