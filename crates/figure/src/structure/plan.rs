//! The drawing in two parts, for views that stay open: what never changes, and a sign for each component whose look
//! follows its state.

use svg::node::element::{Anchor, Circle, Group, Title, Use};
use truss::Structure;
use vocabulary::ComponentPath;

use super::projection::{PagePoint, Projection};
use super::{ComponentPlace, HEADING, LEFT, NAMES, StructureDrawing, symbols};

/// Room above the figure \[px\].
const ABOVE: f64 = 34.0;
/// Room below it, for supports \[px\].
const BELOW: f64 = 44.0;
/// Size of the badge on a component \[px\].
const BADGE: f64 = 21.0;

/// How a component looks.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct SignLook {
    /// Classes of the style sheet, e.g. `latched`.
    pub class: String,
    /// The identifier of the `symbol` element that is drawn upon it; empty for none.
    pub badge: String,
    /// The component and its state, for those who point at it or have it read out.
    pub title: String,
    /// What it links to.
    pub href: String,
}

/// A structure laid out on paper: where each of its components is drawn.
pub struct StructurePlan {
    ground: String,
    places: Vec<ComponentPlace>,
    view_box: [f64; 4],
}

impl std::fmt::Debug for StructurePlan {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Plan").field("components", &self.places.len()).finish_non_exhaustive()
    }
}

impl StructurePlan {
    /// Lays a structure out.
    #[must_use]
    pub fn of(structure: &Structure) -> StructurePlan {
        let projection = Projection::fit(structure, PagePoint { x: LEFT, y: HEADING });
        let [width, height] = projection.size;
        let drawing = StructureDrawing { structure, projection };
        let ground =
            Group::new().add(drawing.modules()).add(drawing.members()).add(drawing.supports());
        let view_box =
            [0.0, HEADING - ABOVE, (LEFT + width + NAMES).ceil(), (height + ABOVE + BELOW).ceil()];
        StructurePlan { ground: ground.to_string(), places: drawing.places(), view_box }
    }

    /// The `viewBox` that both parts are drawn in.
    #[must_use]
    pub fn view_box(&self) -> String {
        self.view_box.map(|number| number.to_string()).join(" ")
    }

    /// Members, supports, boundaries and names of modules: SVG text for within an `svg` element.
    #[must_use]
    pub fn ground(&self) -> &str {
        &self.ground
    }

    /// The components, in the order in which they are drawn.
    pub fn components(&self) -> impl Iterator<Item = &ComponentPath> {
        self.places.iter().map(|place| &place.component)
    }

    /// A link for each component, with its sign, its name and its badge: SVG text for within an `svg` element. Names and
    /// titles are escaped.
    #[must_use]
    pub fn signs(&self, look: impl Fn(&ComponentPath) -> SignLook) -> String {
        self.places.iter().map(|place| sign(place, &look(&place.component)).to_string()).collect()
    }
}

fn sign(place: &ComponentPlace, look: &SignLook) -> Anchor {
    let PagePoint { x, y } = place.at;
    // Larger than the sign, so that a finger finds it.
    let target = Circle::new()
        .set("class", "target")
        .set("cx", symbols::tenths(x))
        .set("cy", symbols::tenths(y))
        .set("r", 17)
        .set("fill", "none")
        .set("pointer-events", "all");
    let link = Anchor::new()
        .set("class", format!("mark {}", look.class))
        .set("href", look.href.as_str())
        .set("aria-label", look.title.as_str())
        .add(Title::new(look.title.as_str()))
        .add(target)
        .add(place.sign.clone())
        .add(place.label());
    if look.badge.is_empty() {
        return link;
    }
    let badge = Use::new()
        .set("href", format!("#{}", look.badge))
        .set("x", symbols::tenths(x - 0.5 * BADGE))
        .set("y", symbols::tenths(y - 0.5 * BADGE))
        .set("width", BADGE)
        .set("height", BADGE);
    link.add(badge)
}
