//! The drawing in two parts, for views that stay open: a constant background, and a sign for each component that
//! follows its state.

use svg::node::element::{Anchor, Circle, Group, Title, Use};
use truss::Structure;
use vocabulary::ComponentPath;

use super::projection::{PagePoint, Projection};
use crate::plot::ink::tenths;

use super::{ComponentPlace, HEADING, LEFT, NAMES, StructureDrawing};

/// Space above the figure \[px\].
const ABOVE: f64 = 34.0;
/// Space below the figure, for supports \[px\].
const BELOW: f64 = 44.0;
/// Size of the badge on a component \[px\].
const BADGE: f64 = 21.0;

/// What is shown around a component \[px\].
const AROUND: f64 = 95.0;

/// The style of a component.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct SignLook {
    /// CSS classes, e.g. `latched`.
    pub class: String,
    /// The identifier of the `symbol` element drawn over it; empty for none.
    pub badge: String,
    /// The component and its state, for tooltips and screen readers.
    pub title: String,
    /// The target of its link.
    pub href: String,
}

/// The layout of a structure on the page: the positions of its components.
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
    /// Computes the layout of a structure.
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

    /// The `viewBox` of both parts.
    #[must_use]
    pub fn view_box(&self) -> String {
        self.view_box.map(|number| number.to_string()).join(" ")
    }

    /// Members, supports, boundaries and names of modules: SVG text to be placed in an `svg` element.
    #[must_use]
    pub fn ground(&self) -> &str {
        &self.ground
    }

    /// The components, in drawing order.
    pub fn components(&self) -> impl Iterator<Item = &ComponentPath> {
        self.places.iter().map(|place| &place.component)
    }

    /// The `viewBox` of the surroundings of a component, if the structure has it.
    #[must_use]
    pub fn view_box_around(&self, component: &ComponentPath) -> Option<String> {
        let PagePoint { x, y } = self.places.iter().find(|place| place.component == *component)?.at;
        let corner = [x - AROUND, y - AROUND].map(tenths);
        Some(format!("{} {} {} {}", corner[0], corner[1], 2.0 * AROUND, 2.0 * AROUND))
    }

    /// A link for each component, with its sign, name and badge: SVG text to be placed in an `svg` element. Names and
    /// titles are escaped.
    #[must_use]
    pub fn signs(&self, look: impl Fn(&ComponentPath) -> SignLook) -> String {
        self.places.iter().map(|place| sign(place, &look(&place.component)).to_string()).collect()
    }
}

fn sign(place: &ComponentPlace, look: &SignLook) -> Anchor {
    let PagePoint { x, y } = place.at;
    // Larger than the sign, so that it is easy to tap.
    let target = Circle::new()
        .set("class", "target")
        .set("cx", tenths(x))
        .set("cy", tenths(y))
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
        .set("x", tenths(x - 0.5 * BADGE))
        .set("y", tenths(y - 0.5 * BADGE))
        .set("width", BADGE)
        .set("height", BADGE);
    link.add(badge)
}
