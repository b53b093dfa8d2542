//! `trusswatch web`: the page.

mod arguments;

use shell::{logging, runtime};

use crate::failure::Failure;
use crate::{model, web_access};

pub(crate) use arguments::Arguments;
use arguments::Command;

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    if let Some(Command::Link(arguments)) = &arguments.command {
        return web_access::link(arguments);
    }
    logging::start();
    let target = arguments.link.target()?;
    let drawing = arguments.drawing.as_deref().map(model::read).transpose()?;
    let config = web::WebConfig {
        network: target.network().clone(),
        structure: target.structure.clone(),
        expected: arguments.expect.clone(),
        listener: arguments.access.listener(arguments.listen)?,
        require_sign_in: arguments.access.require_sign_in,
        revoked: arguments.access.revoked()?,
        drawing,
        state_dir: arguments.state_dir.clone(),
        timeout: target.timeout,
    };
    Ok(runtime::until_done(arguments.shutdown, |shutdown| web::run(config, shutdown))?)
}
