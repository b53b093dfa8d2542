//! Draws the structure: an axonometric view with supports, actuators, gages, module boundaries and a legend.

mod legend;
mod placement;
mod plan;
mod projection;
mod symbols;

use svg::Document;
use svg::node::element::{Circle, Group, Polygon, Rectangle};
use truss::{Actuator, Member, Module, Node, Structure};
use vocabulary::{Component, ComponentKind, ComponentPath};

use self::placement::Placement;
pub use self::plan::{SignLook, StructurePlan};
use self::projection::{PagePoint, Projection, hull, range};
use self::symbols::{Style, SupportKind, kind_of_support};
use crate::plot::ink::{Anchor, tenths};

/// Margin around the figure [px].
const MARGIN: f64 = 40.0;
/// Space above the figure for the heading [px].
const HEADING: f64 = 110.0;
/// Space below the figure for supports and scale [px].
const FOOT: f64 = 110.0;
/// Space left of the figure for heights [px].
const LEFT: f64 = 130.0;
/// Space right of the figure for brackets and the names of modules [px].
const NAMES: f64 = 250.0;
/// Distance of an actuator from the line between its nodes [px].
const ACTUATOR_OFFSET: f64 = 17.0;
/// Distance of an actuator's name from its line [px].
const NAME_OFFSET: f64 = 19.0;

/// Radius of the ring around a component [px].
const RING: f64 = 30.0;

/// Draws the structure as an SVG document: text to be written to a file.
#[must_use]
pub fn drawing(structure: &Structure) -> String {
    document(structure, None)
}

/// The same, with a ring around one component.
#[must_use]
pub fn drawing_of_one(structure: &Structure, component: &ComponentPath) -> String {
    document(structure, Some(component))
}

fn document(structure: &Structure, marked: Option<&ComponentPath>) -> String {
    let corner = PagePoint { x: LEFT, y: HEADING };
    let projection = Projection::fit(structure, corner);
    let [figure_width, figure_height] = projection.size;
    let legend_at = PagePoint { x: LEFT + figure_width + NAMES, y: HEADING };
    let width = legend_at.x + legend::WIDTH + MARGIN;
    let height = HEADING + figure_height.max(legend::HEIGHT) + FOOT;
    let drawing = StructureDrawing { structure, projection };
    let ring = marked.and_then(|component| drawing.ring(component));
    let document = Document::new()
        .set("viewBox", (0, 0, width.ceil(), height.ceil()))
        .set("width", width.ceil())
        .set("height", height.ceil())
        .add(Rectangle::new().set("width", "100%").set("height", "100%").set("fill", "#ffffff"))
        .add(drawing.heading())
        .add(drawing.modules())
        .add(drawing.members())
        .add(drawing.supports())
        .add(drawing.equipment())
        .add(legend::legend(legend_at, structure))
        .add(legend::scale_and_axes(
            PagePoint { x: LEFT, y: HEADING + figure_height + 78.0 },
            legend_at.offset(40.0, legend::HEIGHT + 10.0),
            &drawing.projection,
        ));
    ring.into_iter().fold(document, Document::add).to_string()
}

struct StructureDrawing<'a> {
    structure: &'a Structure,
    projection: Projection,
}

impl StructureDrawing<'_> {
    fn node(&self, node: usize) -> &Node {
        // Indices in a structure are valid in its own lists.
        &self.structure.nodes[node]
    }

    fn points(&self, ends: [usize; 2]) -> [PagePoint; 2] {
        ends.map(|end| self.projection.point(self.node(end).position_m))
    }

    /// A ring around a component, if the structure has it.
    fn ring(&self, component: &ComponentPath) -> Option<Circle> {
        let place = self.places().into_iter().find(|place| place.component == *component)?;
        let ring = Circle::new()
            .set("cx", tenths(place.at.x))
            .set("cy", tenths(place.at.y))
            .set("r", RING)
            .set("fill", "none")
            .set("stroke", "#c4161c")
            .set("stroke-width", 5);
        Some(ring)
    }

    fn nearness(&self, member: &Member) -> f64 {
        let [from, to] = member.ends.map(|end| self.node(end).position_m);
        self.projection.nearness(std::array::from_fn(|i| 0.5 * (from[i] + to[i])))
    }

    fn heading(&self) -> Group {
        let Structure { name, nodes, members, modules, .. } = self.structure;
        let [low, high] = range(nodes.iter().map(|node| node.position_m[2]));
        let figures = format!(
            "{:.1} m high, {} nodes, {} members, {}",
            high - low,
            nodes.len(),
            members.len(),
            counted(modules.len(), "module")
        );
        let left = PagePoint { x: MARGIN, y: 50.0 };
        Group::new().add(symbols::text(left, name.as_str(), Style::HEADING)).add(symbols::text(
            left.offset(0.0, 24.0),
            &figures,
            Style::NOTE,
        ))
    }

    /// Boundaries, brackets and names of the modules.
    fn modules(&self) -> Group {
        let mut group = Group::new();
        let mut lanes: Vec<Vec<[f64; 2]>> = Vec::new();
        for module in &self.structure.modules {
            let heights = self.heights(module);
            let lane = free_lane(&mut lanes, heights);
            if !module.lower_interface.is_empty() {
                group = group.add(self.boundary(module));
            }
            group = group.add(self.bracket(module, heights, lane));
        }
        group
    }

    fn heights(&self, module: &Module) -> [f64; 2] {
        range(module.nodes.iter().map(|&node| self.node(node).position_m[2]))
    }

    /// The plane between a module and the one below.
    fn boundary(&self, module: &Module) -> Polygon {
        let nodes = module.lower_interface.iter().map(|&node| self.node(node).position_m);
        let corners = hull(nodes.map(|position| self.projection.point(position)).collect());
        let count = corners.len().max(1) as f64;
        let centre = PagePoint {
            x: corners.iter().map(|corner| corner.x).sum::<f64>() / count,
            y: corners.iter().map(|corner| corner.y).sum::<f64>() / count,
        };
        let wide = corners.iter().map(|corner| centre.towards(*corner, 1.22));
        let points: Vec<String> =
            wide.map(|corner| format!("{},{}", tenths(corner.x), tenths(corner.y))).collect();
        symbols::boundary(&points.join(" "))
    }

    /// The leftmost and the rightmost of a module's nodes at a given height, on the page.
    fn edges(&self, module: &Module, height_m: f64) -> [PagePoint; 2] {
        let nodes = module.nodes.iter().map(|&node| self.node(node).position_m);
        let level = nodes.filter(|position| (position[2] - height_m).abs() < 1e-6);
        let mut points: Vec<PagePoint> = level.map(|place| self.projection.point(place)).collect();
        points.sort_by(|a, b| a.x.total_cmp(&b.x));
        let corner = PagePoint { x: LEFT, y: HEADING };
        [points.first(), points.last()].map(|point| point.copied().unwrap_or(corner))
    }

    /// Height marks on the left, bracket and name on the right.
    fn bracket(&self, module: &Module, heights: [f64; 2], lane: usize) -> Group {
        let right = LEFT + self.projection.size[0] + 52.0 + 26.0 * lane as f64;
        let mut group = Group::new();
        for height in heights {
            let mark = PagePoint { x: LEFT - 62.0, y: self.edges(module, height)[0].y };
            let words = format!("{height:.1} m");
            let style = Style { anchor: Anchor::End, ..Style::NOTE };
            group = group
                .add(symbols::text(mark.offset(-6.0, 5.0), &words, style))
                .add(symbols::line([mark, mark.offset(18.0, 0.0)], 1.2, symbols::FAINT));
        }
        let [bottom, top] = heights.map(|height| self.edges(module, height)[1].y);
        let spine = [PagePoint { x: right, y: bottom - 4.0 }, PagePoint { x: right, y: top + 4.0 }];
        for end in spine {
            group = group.add(symbols::line([end, end.offset(-9.0, 0.0)], 1.8, symbols::INK));
        }
        let middle = spine[0].towards(spine[1], 0.5).offset(16.0, 0.0);
        group
            .add(symbols::line(spine, 1.8, symbols::INK))
            .add(symbols::text(middle, module.name.as_str(), Style::NAME))
            .add(symbols::text(middle.offset(0.0, 21.0), &equipment_of(module), Style::NOTE))
    }

    /// Members from the farthest to the nearest, then joints.
    fn members(&self) -> Group {
        let mut order: Vec<&Member> = self.structure.members.iter().collect();
        order.sort_by(|a, b| self.nearness(a).total_cmp(&self.nearness(b)));
        let mut group = Group::new();
        for member in order {
            let width = symbols::member_width(member.is_beam());
            let colour = symbols::grey(self.nearness(member));
            group = group.add(symbols::member(self.points(member.ends), width, &colour));
        }
        for node in &self.structure.nodes {
            let colour = symbols::grey(self.projection.nearness(node.position_m));
            group = group.add(symbols::joint(self.projection.point(node.position_m), &colour));
        }
        group
    }

    fn supports(&self) -> Group {
        let held = self.structure.nodes.iter().filter(|node| node.support.is_any());
        held.fold(Group::new(), |group, node| {
            let at = self.projection.point(node.position_m).offset(0.0, 3.0);
            group.add(match kind_of_support(&node.support) {
                SupportKind::Clamped => symbols::clamped(at),
                SupportKind::Pinned => symbols::pinned(at),
                SupportKind::Guided => symbols::guided(at),
            })
        })
    }

    /// Actuators and gages with their names.
    fn equipment(&self) -> Group {
        let places = self.places();
        let mut group = Group::new();
        for kind in [ComponentKind::Actuator, ComponentKind::Sensor] {
            let of_kind = |place: &&ComponentPlace| place.component.component.kind() == kind;
            for ComponentPlace { sign, .. } in places.iter().filter(of_kind) {
                group = group.add(sign.clone());
            }
        }
        places.iter().fold(group, |group, place| group.add(place.label()))
    }

    /// The positions of all actuators and gages, each with its name if there is space.
    fn places(&self) -> Vec<ComponentPlace> {
        let mut placement = Placement::default();
        for member in &self.structure.members {
            placement.line(self.points(member.ends));
        }
        for node in &self.structure.nodes {
            placement.mark(self.projection.point(node.position_m));
        }
        let modules = &self.structure.modules;
        let actuators =
            || modules.iter().flat_map(|module| module.actuators.iter().map(move |a| (module, a)));
        for (_, actuator) in actuators() {
            let line = self.beside(actuator);
            for part in [0.3, 0.4, 0.5, 0.6, 0.7] {
                placement.mark(line[0].towards(line[1], part));
            }
            placement.line(line);
        }
        let mut places = Vec::new();
        for module in modules {
            for gage in &module.gages {
                let line = self.points(self.structure.gage_member(gage).ends);
                let at = gage_place(&placement, line);
                placement.mark(at);
                let name_at = gage_name_place(&mut placement, at);
                let component = Component::Sensor(gage.name.clone());
                let sign = symbols::gage(at, line);
                places.push(ComponentPlace {
                    component: path(module, component),
                    at,
                    sign,
                    name_at,
                });
            }
        }
        for (module, actuator) in actuators() {
            let line = self.beside(actuator);
            let name_at = self.actuator_name_place(&placement, actuator);
            placement.mark(name_at);
            let component = Component::Actuator(actuator.name.clone());
            let (at, sign) = (line[0].towards(line[1], 0.5), symbols::cylinder(line));
            places.push(ComponentPlace { component: path(module, component), at, sign, name_at });
        }
        places
    }

    /// The line of an actuator, moved outwards so that it does not hide the member beside it.
    fn beside(&self, actuator: &Actuator) -> [PagePoint; 2] {
        let [from, to] = self.points(actuator.ends);
        let away = self.outwards([from, to]);
        let shifted =
            |point: PagePoint| point.offset(away.x * ACTUATOR_OFFSET, away.y * ACTUATOR_OFFSET);
        let (from, to) = (shifted(from), shifted(to));
        [from.towards(to, 0.03), to.towards(from, 0.03)]
    }

    /// Unit vector perpendicular to a line, away from the middle of the figure.
    fn outwards(&self, [from, to]: [PagePoint; 2]) -> PagePoint {
        let length = from.distance(to).max(1e-9);
        let across = PagePoint { x: (to.y - from.y) / length, y: -(to.x - from.x) / length };
        let middle = LEFT + 0.5 * self.projection.size[0];
        let outside = (from.towards(to, 0.5).x - middle) * across.x >= 0.0;
        if outside { across } else { PagePoint { x: -across.x, y: -across.y } }
    }

    fn actuator_name_place(&self, placement: &Placement, actuator: &Actuator) -> PagePoint {
        let line = self.beside(actuator);
        let away = self.outwards(line);
        let length = line[0].distance(line[1]).max(1e-9);
        // Beside the barrel, within this distance of its middle.
        let places = [0.0, 18.0, -18.0, 36.0, -36.0].map(|along| {
            let middle = line[0].towards(line[1], 0.5 + along / length);
            middle.offset(away.x * NAME_OFFSET, away.y * NAME_OFFSET)
        });
        placement.roomiest(places, Some(line)).unwrap_or(places[0])
    }
}

fn gage_place(placement: &Placement, line: [PagePoint; 2]) -> PagePoint {
    let places = [0.5, 0.42, 0.58, 0.35, 0.65, 0.28, 0.72, 0.22, 0.78]
        .map(|part| line[0].towards(line[1], part));
    placement.roomiest(places, Some(line)).unwrap_or(places[0])
}

/// The position of a component, and its name.
struct ComponentPlace {
    component: ComponentPath,
    at: PagePoint,
    sign: Group,
    name_at: PagePoint,
}

impl ComponentPlace {
    fn label(&self) -> svg::node::element::Text {
        let ink = match self.component.component.kind() {
            ComponentKind::Actuator => symbols::ACTUATOR_INK,
            ComponentKind::Sensor => symbols::GAGE_INK,
        };
        symbols::label(self.name_at, self.component.component.name(), ink)
    }
}

fn path(module: &Module, component: Component) -> ComponentPath {
    ComponentPath { module: module.name.clone(), component }
}

fn gage_name_place(placement: &mut Placement, at: PagePoint) -> PagePoint {
    let around = [
        (-22.0, 0.0),
        (22.0, 0.0),
        (20.0, -13.0),
        (-20.0, -13.0),
        (20.0, 13.0),
        (-20.0, 13.0),
        (0.0, -20.0),
        (0.0, 20.0),
    ];
    let places = around.map(|(x, y)| at.offset(x, y));
    let place = placement.roomiest(places, None).unwrap_or(places[0]);
    placement.mark(place);
    place
}

/// The first lane in which a bracket does not overlap an earlier one.
fn free_lane(lanes: &mut Vec<Vec<[f64; 2]>>, [low, high]: [f64; 2]) -> usize {
    let apart = |taken: &Vec<[f64; 2]>| taken.iter().all(|&[a, b]| b <= low || high <= a);
    match lanes.iter_mut().position(|lane| apart(lane)) {
        Some(lane) => {
            lanes[lane].push([low, high]);
            lane
        }
        None => {
            lanes.push(vec![[low, high]]);
            lanes.len() - 1
        }
    }
}

fn equipment_of(module: &Module) -> String {
    if module.is_equipped() {
        let actuators = counted(module.actuators.len(), "actuator");
        format!("{actuators}, {}", counted(module.gages.len(), "gage"))
    } else {
        "not equipped".to_owned()
    }
}

fn counted(count: usize, what: &str) -> String {
    if count == 1 { format!("1 {what}") } else { format!("{count} {what}s") }
}
