//! What is drawn over a picture, in millimetres of paper from its upper left corner, x right, y down: the same for pixels, SVG and PDF.

/// A point on the paper, mm.
pub type At = [f64; 2];

/// A step of an outline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// Begins anew.
    Move(At),
    /// Straight on.
    Line(At),
    /// A quadratic Bézier curve by its control point and its end.
    Quad(At, At),
    /// A cubic one.
    Cubic(At, At, At),
    /// Back to where it began.
    Close,
}

/// How an outline is drawn along.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke {
    /// sRGB.
    pub color: [u8; 3],
    /// Width, mm.
    pub width_mm: f64,
    /// Lengths of dashes and of the gaps between them, mm.
    pub dash_mm: Option<f64>,
}

impl Stroke {
    /// A whole line.
    pub fn new(color: [u8; 3], width_mm: f64) -> Self {
        Self { color, width_mm, dash_mm: None }
    }
}

/// An outline, filled and then drawn along.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    /// The outline.
    pub steps: Vec<Step>,
    /// sRGB of what it holds.
    pub fill: Option<[u8; 3]>,
    /// How it is drawn along.
    pub stroke: Option<Stroke>,
}

impl Shape {
    /// A filled rectangle.
    pub fn rectangle([x, y]: At, [width, height]: [f64; 2], color: [u8; 3]) -> Self {
        let corners = [[x, y], [x + width, y], [x + width, y + height], [x, y + height]];
        let steps = vec![Step::Move(corners[0]), Step::Line(corners[1]), Step::Line(corners[2]), Step::Line(corners[3]), Step::Close];
        Self { steps, fill: Some(color), stroke: None }
    }

    /// A line through points.
    pub fn line(points: &[At], stroke: Stroke) -> Self {
        let steps = points.iter().enumerate().map(|(n, p)| if n == 0 { Step::Move(*p) } else { Step::Line(*p) }).collect();
        Self { steps, fill: None, stroke: Some(stroke) }
    }

    /// A circle, filled, drawn along or both.
    pub fn circle([x, y]: At, radius: f64, fill: Option<[u8; 3]>, stroke: Option<Stroke>) -> Self {
        // A quarter of a circle as a cubic is off by 2.7e-4 of its radius with this handle.
        let handle = 0.552_284_75 * radius;
        let quarter = |[ax, ay]: At, [bx, by]: At| {
            let [from, to] = [[ax, ay], [bx, by]].map(|[u, v]| [x + radius * u, y + radius * v]);
            Step::Cubic([from[0] + handle * bx, from[1] + handle * by], [to[0] + handle * ax, to[1] + handle * ay], to)
        };
        let ends = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0], [1.0, 0.0]];
        let mut steps = vec![Step::Move([x + radius, y])];
        steps.extend(ends.windows(2).map(|pair| quarter(pair[0], pair[1])));
        steps.push(Step::Close);
        Self { steps, fill, stroke }
    }

    /// The points that it leads through, without controls.
    pub fn points(&self) -> impl Iterator<Item = At> + '_ {
        self.steps.iter().filter_map(|step| match *step {
            Step::Move(p) | Step::Line(p) | Step::Quad(_, p) | Step::Cubic(_, _, p) => Some(p),
            Step::Close => None,
        })
    }
}

/// Shapes that are one thing to a reader.
#[derive(Clone, Debug, PartialEq)]
pub struct Mark {
    /// What it says, or what it is.
    pub words: String,
    /// From the lowest to the uppermost.
    pub shapes: Vec<Shape>,
}

impl Mark {
    /// The box around it: its upper left and its lower right corner, mm.
    pub fn bounds(&self) -> [At; 2] {
        let wide = |[low, high]: [At; 2], p: At| [[low[0].min(p[0]), low[1].min(p[1])], [high[0].max(p[0]), high[1].max(p[1])]];
        self.shapes.iter().flat_map(Shape::points).fold([[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]], wide)
    }
}
