//! `trusswatch web`: the page.

mod arguments;

use shell::{logging, runtime};

use crate::failure::Failure;
use crate::model;

pub(crate) use arguments::Arguments;

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    logging::start();
    let target = arguments.link.target()?;
    let drawing = arguments.drawing.as_deref().map(model::read).transpose()?;
    let config = web::WebConfig {
        network: target.network().clone(),
        structure: target.structure.clone(),
        expected: arguments.expect.clone(),
        listen: arguments.listen,
        drawing,
        state_dir: arguments.state_dir.clone(),
        timeout: target.timeout,
    };
    Ok(runtime::until_done(arguments.shutdown, |shutdown| web::run(config, shutdown))?)
}
