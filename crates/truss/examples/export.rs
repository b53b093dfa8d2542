//! Prints the export of a structure as JSON: `cargo run -p truss --example export -- FILE [MODULE]`.

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let file = arguments.next().ok_or("name the file of a structure")?;
    let mut structure = truss::Structure::from_toml(&std::fs::read_to_string(file)?)?;
    if let Some(module) = arguments.next() {
        structure = structure.local(&module.parse()?)?;
    }
    serde_json::to_writer_pretty(std::io::stdout(), &structure.export()?)?;
    Ok(())
}
