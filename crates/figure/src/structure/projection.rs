//! Projects space onto the page: a parallel projection from slightly above, rotated so that columns do not hide each
//! other.

use truss::Structure;

/// Candidate rotations about the vertical [°]. The first suits a square plan: its tangent is ½, so the four corners are
/// evenly spaced.
const AZIMUTHS: [f64; 9] = [26.565, 20.0, 15.0, 10.0, 35.0, 40.0, 50.0, 60.0, 70.0];
/// Most positions of a plan that are compared.
const MOST_PLACES: usize = 100;
/// Elevation of the viewpoint [rad].
const ELEVATION: f64 = 0.30;
/// Space for the figure on the page [px].
const ROOM: [f64; 2] = [520.0, 1180.0];
/// Largest magnification [px/m].
const LARGEST_SCALE: f64 = 90.0;

/// A position on the page [px].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PagePoint {
    pub(super) x: f64,
    pub(super) y: f64,
}

impl PagePoint {
    /// The point at a given fraction of the way to another.
    pub(super) fn towards(self, other: PagePoint, part: f64) -> PagePoint {
        PagePoint { x: self.x + part * (other.x - self.x), y: self.y + part * (other.y - self.y) }
    }

    /// The point displaced by x and y.
    pub(super) fn offset(self, x: f64, y: f64) -> PagePoint {
        PagePoint { x: self.x + x, y: self.y + y }
    }

    pub(super) fn distance(self, other: PagePoint) -> f64 {
        (self.x - other.x).hypot(self.y - other.y)
    }

    /// Distance from the line through two points.
    pub(super) fn distance_from_line(self, [from, to]: [PagePoint; 2]) -> f64 {
        let along = PagePoint { x: to.x - from.x, y: to.y - from.y };
        let length = (along.x * along.x + along.y * along.y).max(1e-12);
        let part = ((self.x - from.x) * along.x + (self.y - from.y) * along.y) / length;
        self.distance(from.towards(to, part.clamp(0.0, 1.0)))
    }
}

/// Scale and position of the figure.
pub(super) struct Projection {
    view: ViewDirection,
    scale: f64,
    origin: PagePoint,
    depths: [f64; 2],
    /// Size of the figure [px].
    pub(super) size: [f64; 2],
}

impl Projection {
    /// Fits a structure into the available space, with its upper left corner at a given position.
    pub(super) fn fit(structure: &Structure, corner: PagePoint) -> Projection {
        let view = ViewDirection::of(structure);
        let flat: Vec<PagePoint> =
            structure.nodes.iter().map(|node| view.flatten(node.position_m)).collect();
        let [left, right] = range(flat.iter().map(|point| point.x));
        let [top, bottom] = range(flat.iter().map(|point| point.y));
        let (width, height) = ((right - left).max(1e-9), (bottom - top).max(1e-9));
        let scale = (ROOM[0] / width).min(ROOM[1] / height).min(LARGEST_SCALE);
        Projection {
            view,
            scale,
            origin: PagePoint { x: corner.x - scale * left, y: corner.y - scale * top },
            depths: range(structure.nodes.iter().map(|node| view.depth(node.position_m))),
            size: [scale * width, scale * height],
        }
    }

    /// Pixels per metre.
    pub(super) fn scale(&self) -> f64 {
        self.scale
    }

    /// Projects a position in space onto the page.
    pub(super) fn point(&self, position_m: [f64; 3]) -> PagePoint {
        let flat = self.view.flatten(position_m);
        PagePoint { x: self.origin.x + self.scale * flat.x, y: self.origin.y + self.scale * flat.y }
    }

    /// The relative depth of a position: 0 for the farthest, 1 for the nearest.
    pub(super) fn nearness(&self, position_m: [f64; 3]) -> f64 {
        let [far, near] = self.depths;
        if near - far < 1e-9 { 1.0 } else { (self.view.depth(position_m) - far) / (near - far) }
    }

    /// The direction of a global axis on the page, for one metre [px].
    pub(super) fn direction(&self, axis: [f64; 3]) -> PagePoint {
        let flat = self.view.flatten(axis);
        PagePoint { x: self.scale * flat.x, y: self.scale * flat.y }
    }
}

/// The direction of view.
#[derive(Clone, Copy)]
struct ViewDirection {
    sine: f64,
    cosine: f64,
}

impl ViewDirection {
    /// The view in which the columns of a structure are farthest apart.
    fn of(structure: &Structure) -> ViewDirection {
        let mut plan: Vec<[f64; 2]> =
            structure.nodes.iter().map(|node| [node.position_m[0], node.position_m[1]]).collect();
        plan.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
        plan.dedup();
        plan.truncate(MOST_PLACES);
        let mut best = ViewDirection::turned(AZIMUTHS[0]);
        let mut widest = best.narrowest_gap(&plan);
        for azimuth in AZIMUTHS {
            let view = ViewDirection::turned(azimuth);
            let gap = view.narrowest_gap(&plan);
            if gap > widest * 1.001 {
                (best, widest) = (view, gap);
            }
        }
        best
    }

    fn turned(degrees: f64) -> ViewDirection {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        ViewDirection { sine, cosine }
    }

    /// Smallest distance on the page between positions of a plan.
    fn narrowest_gap(&self, plan: &[[f64; 2]]) -> f64 {
        let mut across: Vec<f64> = plan.iter().map(|&[x, y]| self.flatten([x, y, 0.0]).x).collect();
        across.sort_by(f64::total_cmp);
        across.iter().zip(across.iter().skip(1)).map(|(a, b)| b - a).fold(f64::INFINITY, f64::min)
    }

    /// Projects a position in space onto the page, in metres.
    fn flatten(&self, [x, y, z]: [f64; 3]) -> PagePoint {
        let across = self.cosine * x + self.sine * y;
        let away = self.cosine * y - self.sine * x;
        PagePoint { x: across, y: -(z * ELEVATION.cos() + away * ELEVATION.sin()) }
    }

    /// Component towards the viewer, within the plan.
    fn depth(&self, [x, y, _]: [f64; 3]) -> f64 {
        self.sine * x - self.cosine * y
    }
}

/// Smallest and largest.
pub(super) fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
        [low.min(value), high.max(value)]
    })
}

/// The convex hull of points, in order around it.
pub(super) fn hull(mut points: Vec<PagePoint>) -> Vec<PagePoint> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let mut hull = half_hull(points.iter().copied());
    hull.pop();
    let mut upper = half_hull(points.iter().rev().copied());
    upper.pop();
    hull.extend(upper);
    hull
}

fn half_hull(points: impl Iterator<Item = PagePoint>) -> Vec<PagePoint> {
    let mut half: Vec<PagePoint> = Vec::new();
    for point in points {
        while let [.., a, b] = half.as_slice() {
            let turn = (b.x - a.x) * (point.y - a.y) - (b.y - a.y) * (point.x - a.x);
            if turn > 0.0 {
                break;
            }
            half.pop();
        }
        half.push(point);
    }
    half
}
