//! The shipped tower with more of its modules equipped.

use truss::Structure;

/// Storeys of a module.
const STOREYS: usize = 3;
const MODULES: usize = 4;

/// The tower whose lowest modules are equipped, so many of them, each like the lowest two.
pub fn with_equipped(count: usize) -> Structure {
    let shipped = include_str!("../../../../configs/tower.toml");
    let mut tables: Vec<String> = shipped.split("[[modules]]").map(str::to_owned).collect();
    assert_eq!(tables.len(), 1 + MODULES, "what stands before the modules, and each of them");
    for (place, table) in tables.iter_mut().enumerate().skip(1).take(count) {
        if !table.contains("actuators") {
            table.push_str(&equipment((place - 1) * STOREYS));
        }
    }
    Structure::from_toml(&tables.join("[[modules]]")).unwrap()
}

/// A cylinder beside each corner's column; gages on the columns of the lowest storey and on a diagonal of each face.
fn equipment(bottom: usize) -> String {
    let node = |level: usize, corner: usize| format!("L{level:02}C{}", corner % 4 + 1);
    let top = bottom + STOREYS;
    let mut actuators = String::new();
    let mut gages = String::new();
    for corner in 0..4 {
        let number = corner + 1;
        let ends = (node(bottom, corner), node(top, corner));
        actuators +=
            &format!("{{ name = \"a{number}\", between = [\"{}\", \"{}\"] }},", ends.0, ends.1);
        let column = (node(bottom, corner), node(bottom + 1, corner));
        gages += &format!("{{ name = \"g{number}\", member = \"{}-{}\" }},", column.0, column.1);
    }
    for corner in 0..4 {
        let (from, to) = (node(bottom, corner), node(top, corner + 1));
        gages += &format!("{{ name = \"g{}\", member = \"{from}-{to}\" }},", corner + 5);
    }
    format!("actuators = [{actuators}]\ngages = [{gages}]\n\n")
}
