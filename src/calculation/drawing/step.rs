//! Drawings as STEP: every part's prisms as solids in place, flanks as cubic splines.
//!
//! A prism needs a few kinds of record only: planes, cylinders and splines swept along z, and what joins them. They are those
//! of ISO 10303-214 (`AUTOMOTIVE_DESIGN`), which every CAD program reads.

use std::fmt::Write as _;
use std::io::{self, Write};

use super::answer::{BodyAnswer, BodyPart, DrawingAnswer, EdgeAnswer, OutlineAnswer, PlacementAnswer};
use super::svg;

/// Writes a drawing.
///
/// # Errors
/// Those of the writer.
pub(super) fn write(drawing: &DrawingAnswer, writer: &mut dyn Write) -> io::Result<()> {
    let mut step = Step { writer, last: 0 };
    step.head(drawing)?;
    let frame = step.frame()?;
    for body in &drawing.bodies {
        step.product(body, &frame)?;
    }
    writeln!(step.writer, "ENDSEC;\nEND-ISO-10303-21;")
}

/// A record's number.
#[derive(Debug, Clone, Copy)]
struct Id(u64);

impl std::fmt::Display for Id {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "#{}", self.0)
    }
}

/// What all products refer to.
struct Frame {
    product_context: Id,
    definition_context: Id,
    units: Id,
    origin: Id,
}

/// An edge of the bottom, as it is drawn on a prism: counter-clockwise around the material, which is on its left.
enum Side {
    Line { end: [f64; 2] },
    Arc { end: [f64; 2], center: [f64; 2], radius_mm: f64, is_counter_clockwise: bool },
    Curve(Spline),
}

impl Side {
    fn end(&self) -> [f64; 2] {
        match self {
            Self::Line { end } | Self::Arc { end, .. } => *end,
            Self::Curve(spline) => spline.poles.last().copied().unwrap_or_default(),
        }
    }
}

/// The corners and edges of one loop at one height.
struct Level {
    z_mm: f64,
    corners: Vec<Id>,
    edges: Vec<Id>,
    /// Of the splines among the edges, which the surfaces over them share; none of the others.
    poles: Vec<Vec<Id>>,
}

/// The file as it is written: numbered records.
struct Step<'a> {
    writer: &'a mut dyn Write,
    last: u64,
}

impl Step<'_> {
    fn record(&mut self, text: std::fmt::Arguments<'_>) -> io::Result<Id> {
        self.last += 1;
        writeln!(self.writer, "#{}={text};", self.last)?;
        Ok(Id(self.last))
    }

    fn head(&mut self, drawing: &DrawingAnswer) -> io::Result<()> {
        let title = svg::title(drawing);
        // The same design is the same bytes, whenever it is drawn; so there is no date but the first.
        writeln!(
            self.writer,
            "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION(('{title}'),'2;1');\nFILE_NAME('{title}','1970-01-01T00:00:00',(''),(''),'toothwave {}','toothwave','');\nFILE_SCHEMA(('AUTOMOTIVE_DESIGN {{ 1 0 10303 214 1 1 1 1 }}'));\nENDSEC;\nDATA;",
            drawing.solver_version
        )
    }

    fn frame(&mut self) -> io::Result<Frame> {
        let application =
            self.record(format_args!("APPLICATION_CONTEXT('core data for automotive mechanical design processes')"))?;
        self.record(format_args!(
            "APPLICATION_PROTOCOL_DEFINITION('international standard','automotive_design',2000,{application})"
        ))?;
        let product_context = self.record(format_args!("PRODUCT_CONTEXT('',{application},'mechanical')"))?;
        let definition_context =
            self.record(format_args!("PRODUCT_DEFINITION_CONTEXT('part definition',{application},'design')"))?;
        let length = self.record(format_args!("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))"))?;
        let angle = self.record(format_args!("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))"))?;
        let solid_angle = self.record(format_args!("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())"))?;
        let closeness = self.record(format_args!(
            "UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-7),{length},'distance_accuracy_value','how near points are the same')"
        ))?;
        let units = self.record(format_args!(
            "(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT(({closeness}))GLOBAL_UNIT_ASSIGNED_CONTEXT(({length},{angle},{solid_angle}))REPRESENTATION_CONTEXT('',''))"
        ))?;
        let origin = self.placement([0.0; 3], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0])?;
        Ok(Frame { product_context, definition_context, units, origin })
    }

    fn product(&mut self, body: &BodyAnswer, frame: &Frame) -> io::Result<()> {
        let name = match body.part {
            BodyPart::WaveGenerator => "wave_generator",
            BodyPart::Teeth => "teeth",
            BodyPart::Ring => "ring",
            BodyPart::Carrier => "carrier",
        };
        let Frame { product_context, definition_context, units, origin, .. } = frame;
        let product = self.record(format_args!("PRODUCT('{name}','{name}','',({product_context}))"))?;
        self.record(format_args!("PRODUCT_RELATED_PRODUCT_CATEGORY('part',$,({product}))"))?;
        let formation = self.record(format_args!("PRODUCT_DEFINITION_FORMATION('','',{product})"))?;
        let definition =
            self.record(format_args!("PRODUCT_DEFINITION('design','',{formation},{definition_context})"))?;
        let shape = self.record(format_args!("PRODUCT_DEFINITION_SHAPE('','',{definition})"))?;
        let mut items = origin.to_string();
        for (index, placement) in body.placements.iter().enumerate() {
            let solid = self.solid(body, placement, &format!("{name} {index}"))?;
            // Writing to a string does not fail.
            let _ = write!(items, ",{solid}");
        }
        let representation =
            self.record(format_args!("ADVANCED_BREP_SHAPE_REPRESENTATION('{name}',({items}),{units})"))?;
        self.record(format_args!("SHAPE_DEFINITION_REPRESENTATION({shape},{representation})")).map(drop)
    }

    /// A prism from z = 0 up: a face on every edge, a bottom and a top.
    fn solid(&mut self, body: &BodyAnswer, placement: &PlacementAnswer, name: &str) -> io::Result<Id> {
        let outer = (sides(&body.outer, placement, false), "FACE_OUTER_BOUND");
        let holes = body.holes.iter().map(|hole| (sides(hole, placement, true), "FACE_BOUND"));
        let (mut faces, mut bottom_bounds, mut top_bounds) = (Vec::new(), Vec::new(), Vec::new());
        for (sides, bound) in [outer].into_iter().chain(holes) {
            let bottom = self.level(&sides, 0.0)?;
            let top = self.level(&sides, body.width_mm)?;
            faces.extend(self.walls(&sides, &bottom, &top)?);
            let around = self.edge_loop(top.edges.iter().map(|&edge| (edge, true)))?;
            top_bounds.push(self.record(format_args!("{bound}('',{around},.T.)"))?);
            let around = self.edge_loop(bottom.edges.iter().rev().map(|&edge| (edge, false)))?;
            bottom_bounds.push(self.record(format_args!("{bound}('',{around},.T.)"))?);
        }
        for (bounds, z_mm, up) in [(bottom_bounds, 0.0, -1.0), (top_bounds, body.width_mm, 1.0)] {
            let place = self.placement([0.0, 0.0, z_mm], [0.0, 0.0, up], [1.0, 0.0, 0.0])?;
            let plane = self.record(format_args!("PLANE('',{place})"))?;
            faces.push(self.record(format_args!("ADVANCED_FACE('',({}),{plane},.T.)", list(&bounds)))?);
        }
        let shell = self.record(format_args!("CLOSED_SHELL('',({}))", list(&faces)))?;
        self.record(format_args!("MANIFOLD_SOLID_BREP('{name}',{shell})"))
    }

    /// The corners of a loop at a height, and its edges between them.
    fn level(&mut self, sides: &[Side], z_mm: f64) -> io::Result<Level> {
        let mut corners = Vec::new();
        for side in sides {
            let [x, y] = side.end();
            let point = self.point([x, y, z_mm])?;
            corners.push(self.record(format_args!("VERTEX_POINT('',{point})"))?);
        }
        // Each side ends at the corner of its index and starts at the one before.
        corners.rotate_right(1);
        let (mut edges, mut poles) = (Vec::new(), Vec::new());
        for (index, side) in sides.iter().enumerate() {
            let start = sides[(index + sides.len() - 1) % sides.len()].end();
            poles.push(self.poles(side, z_mm)?);
            let (curve, runs_along) = self.curve(side, start, z_mm, &poles[index])?;
            let (from, to) = (corners[index], corners[(index + 1) % corners.len()]);
            edges.push(self.record(format_args!("EDGE_CURVE('',{from},{to},{curve},{runs_along})"))?);
        }
        Ok(Level { z_mm, corners, edges, poles })
    }

    fn poles(&mut self, side: &Side, z_mm: f64) -> io::Result<Vec<Id>> {
        match side {
            Side::Line { .. } | Side::Arc { .. } => Ok(Vec::new()),
            Side::Curve(spline) => spline.poles.iter().map(|[x, y]| self.point([*x, *y, z_mm])).collect(),
        }
    }

    /// The curve under an edge, and whether the edge runs along it.
    fn curve(&mut self, side: &Side, start: [f64; 2], z_mm: f64, poles: &[Id]) -> io::Result<(Id, &'static str)> {
        match side {
            Side::Line { end } => {
                let point = self.point([start[0], start[1], z_mm])?;
                let [x, y] = unit([end[0] - start[0], end[1] - start[1]]);
                Ok((self.line(point, [x, y, 0.0])?, ".T."))
            }
            Side::Arc { center: [x, y], radius_mm, is_counter_clockwise, .. } => {
                let place = self.placement([*x, *y, z_mm], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0])?;
                let circle = self.record(format_args!("CIRCLE('',{place},{})", Real(*radius_mm)))?;
                Ok((circle, if *is_counter_clockwise { ".T." } else { ".F." }))
            }
            Side::Curve(Spline { multiplicities, knots, .. }) => {
                let spline = self.record(format_args!(
                    "B_SPLINE_CURVE_WITH_KNOTS('',3,({}),.UNSPECIFIED.,.F.,.F.,({multiplicities}),({knots}),.UNSPECIFIED.)",
                    list(poles)
                ))?;
                Ok((spline, ".T."))
            }
        }
    }

    /// The faces that stand on the edges of a loop; seen from outside each runs along the bottom, up, back and down.
    fn walls(&mut self, sides: &[Side], bottom: &Level, top: &Level) -> io::Result<Vec<Id>> {
        let mut uprights = Vec::new();
        for (index, (&from, &to)) in bottom.corners.iter().zip(&top.corners).enumerate() {
            let [x, y] = sides[(index + sides.len() - 1) % sides.len()].end();
            let point = self.point([x, y, bottom.z_mm])?;
            let line = self.line(point, [0.0, 0.0, 1.0])?;
            uprights.push(self.record(format_args!("EDGE_CURVE('',{from},{to},{line},.T.)"))?);
        }
        let mut faces = Vec::new();
        for (index, side) in sides.iter().enumerate() {
            let start = sides[(index + sides.len() - 1) % sides.len()].end();
            let (surface, faces_outward) = self.surface(index, side, start, bottom, top)?;
            let next = (index + 1) % sides.len();
            let around = self.edge_loop([
                (bottom.edges[index], true),
                (uprights[next], true),
                (top.edges[index], false),
                (uprights[index], false),
            ])?;
            let bound = self.record(format_args!("FACE_OUTER_BOUND('',{around},.T.)"))?;
            faces.push(self.record(format_args!("ADVANCED_FACE('',({bound}),{surface},{faces_outward})"))?);
        }
        Ok(faces)
    }

    /// The surface over the edge of an index, and whether its normal points out of the material, to the right of the edge.
    fn surface(
        &mut self,
        index: usize,
        side: &Side,
        start: [f64; 2],
        bottom: &Level,
        top: &Level,
    ) -> io::Result<(Id, &'static str)> {
        match side {
            Side::Line { end } => {
                let [x, y] = unit([end[0] - start[0], end[1] - start[1]]);
                let place = self.placement([start[0], start[1], bottom.z_mm], [y, -x, 0.0], [x, y, 0.0])?;
                Ok((self.record(format_args!("PLANE('',{place})"))?, ".T."))
            }
            Side::Arc { center: [x, y], radius_mm, is_counter_clockwise, .. } => {
                let place = self.placement([*x, *y, bottom.z_mm], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0])?;
                let cylinder = self.record(format_args!("CYLINDRICAL_SURFACE('',{place},{})", Real(*radius_mm)))?;
                // A cylinder's normal points away from its axis.
                Ok((cylinder, if *is_counter_clockwise { ".T." } else { ".F." }))
            }
            Side::Curve(Spline { multiplicities, knots, .. }) => {
                let pairs: Vec<_> = bottom.poles[index]
                    .iter()
                    .zip(&top.poles[index])
                    .map(|(low, high)| format!("({low},{high})"))
                    .collect();
                let pairs = pairs.join(",");
                let surface = self.record(format_args!(
                    "B_SPLINE_SURFACE_WITH_KNOTS('',3,1,({pairs}),.UNSPECIFIED.,.F.,.F.,.F.,({multiplicities}),(2,2),({knots}),(0.,1.),.UNSPECIFIED.)"
                ))?;
                Ok((surface, ".T."))
            }
        }
    }

    fn edge_loop(&mut self, edges: impl IntoIterator<Item = (Id, bool)>) -> io::Result<Id> {
        let mut ids = Vec::new();
        for (edge, runs_along) in edges {
            let sense = if runs_along { ".T." } else { ".F." };
            ids.push(self.record(format_args!("ORIENTED_EDGE('',*,*,{edge},{sense})"))?);
        }
        self.record(format_args!("EDGE_LOOP('',({}))", list(&ids)))
    }

    fn line(&mut self, point: Id, direction: [f64; 3]) -> io::Result<Id> {
        let direction = self.direction(direction)?;
        let vector = self.record(format_args!("VECTOR('',{direction},1.)"))?;
        self.record(format_args!("LINE('',{point},{vector})"))
    }

    fn placement(&mut self, origin: [f64; 3], z: [f64; 3], x: [f64; 3]) -> io::Result<Id> {
        let (origin, z, x) = (self.point(origin)?, self.direction(z)?, self.direction(x)?);
        self.record(format_args!("AXIS2_PLACEMENT_3D('',{origin},{z},{x})"))
    }

    fn point(&mut self, [x, y, z]: [f64; 3]) -> io::Result<Id> {
        self.record(format_args!("CARTESIAN_POINT('',({},{},{}))", Real(x), Real(y), Real(z)))
    }

    fn direction(&mut self, [x, y, z]: [f64; 3]) -> io::Result<Id> {
        self.record(format_args!("DIRECTION('',({},{},{}))", Real(x), Real(y), Real(z)))
    }
}

/// The sides of a prism over an outline; those of a hole run clockwise, so that the material is on their left too.
fn sides(outline: &OutlineAnswer, placement: &PlacementAnswer, is_hole: bool) -> Vec<Side> {
    let place = placement.placing();
    let center = [placement.x_mm, placement.y_mm];
    let mut sides: Vec<_> = match outline {
        OutlineAnswer::Circle { radius_mm } => {
            let half = |x: f64| {
                let end = place([x, 0.0]);
                Side::Arc { end, center, radius_mm: *radius_mm, is_counter_clockwise: !is_hole }
            };
            // Halves, because an edge from a corner to itself is not every reader's strength. A hole's are the same ones.
            return vec![half(-radius_mm), half(*radius_mm)];
        }
        OutlineAnswer::Path { edges } => edges
            .iter()
            .map(|edge| {
                let end = if is_hole { edge.start() } else { edge.end() };
                match edge {
                    EdgeAnswer::Line { .. } => Side::Line { end: place(end) },
                    EdgeAnswer::Arc { radius_mm, sweep_deg, .. } => Side::Arc {
                        end: place(end),
                        center,
                        radius_mm: *radius_mm,
                        is_counter_clockwise: (*sweep_deg > 0.0) != is_hole,
                    },
                    EdgeAnswer::Curve { x_mm, y_mm, start_tangent_deg, end_tangent_deg } => {
                        let mut points: Vec<_> = x_mm.iter().zip(y_mm).map(|(&x, &y)| place([x, y])).collect();
                        let direction = |deg: &f64| {
                            let (sin, cos) = (deg + placement.rotation_deg).to_radians().sin_cos();
                            if is_hole { [-cos, -sin] } else { [cos, sin] }
                        };
                        let mut end_tangents = [direction(start_tangent_deg), direction(end_tangent_deg)];
                        if is_hole {
                            points.reverse();
                            end_tangents.reverse();
                        }
                        Side::Curve(Spline::through(&points, &end_tangents))
                    }
                }
            })
            .collect(),
    };
    if is_hole {
        sides.reverse();
    }
    sides
}

/// A cubic spline as STEP has it.
struct Spline {
    poles: Vec<[f64; 2]>,
    multiplicities: String,
    knots: String,
}

impl Spline {
    /// Through points, of two continuous derivatives over the length of the chords, with unit tangents at both ends; it leaves the
    /// curve by the fourth power of the chord.
    fn through(points: &[[f64; 2]], end_tangents: &[[f64; 2]; 2]) -> Self {
        let chords_mm: Vec<f64> =
            points.windows(2).map(|two| (two[1][0] - two[0][0]).hypot(two[1][1] - two[0][1])).collect();
        let [along_x, along_y] = [0, 1].map(|axis| {
            let column: Vec<f64> = points.iter().map(|point| point[axis]).collect();
            slopes(&column, &chords_mm, end_tangents[0][axis], end_tangents[1][axis])
        });
        let last = chords_mm.len();
        // The inner points of Bézier's polygon of a piece: a third of a chord from its ends, along the slopes there.
        let after = |i: usize, part: f64| [points[i][0] + part * along_x[i], points[i][1] + part * along_y[i]];
        let inner = |i: usize| [after(i, chords_mm[i] / 3.0), after(i + 1, -chords_mm[i] / 3.0)];
        let mut poles = vec![points[0], inner(0)[0]];
        for i in 1..last {
            // Blossoming: the pole of three knots in a row lies on the line through the inner points of the piece after the middle one.
            let ([first, second], ratio) = (inner(i), chords_mm[i - 1] / chords_mm[i]);
            poles.push([0, 1].map(|axis| first[axis] - ratio * (second[axis] - first[axis])));
        }
        poles.extend([inner(last - 1)[1], points[last]]);
        let (mut multiplicities, mut knots) = (String::from("4"), String::from("0."));
        let mut length_mm = 0.0;
        for (i, chord_mm) in chords_mm.iter().enumerate() {
            length_mm += chord_mm;
            // Writing to a string does not fail.
            let _ = write!(multiplicities, ",{}", if i + 1 == last { 4 } else { 1 });
            let _ = write!(knots, ",{}", Real(length_mm));
        }
        Self { poles, multiplicities, knots }
    }
}

/// Slopes at the points of a clamped cubic spline: a tridiagonal system, dominant on its diagonal, solved from both ends.
fn slopes(values: &[f64], chords: &[f64], first: f64, last: f64) -> Vec<f64> {
    let end = chords.len();
    let rise = |i: usize| (values[i + 1] - values[i]) / chords[i];
    let (mut upper, mut right) = (vec![0.0; end + 1], vec![first; end + 1]);
    for i in 1..end {
        let (before, after) = (chords[i - 1], chords[i]);
        let known = 3.0 * (after * rise(i - 1) + before * rise(i));
        let pivot = 2.0 * (before + after) - after * upper[i - 1];
        upper[i] = before / pivot;
        right[i] = (known - after * right[i - 1]) / pivot;
    }
    let mut slopes = right;
    slopes[end] = last;
    for i in (1..end).rev() {
        slopes[i] -= upper[i] * slopes[i + 1];
    }
    slopes
}

fn unit([x, y]: [f64; 2]) -> [f64; 2] {
    let length = x.hypot(y);
    [x / length, y / length]
}

fn list(ids: &[Id]) -> String {
    ids.iter().map(Id::to_string).collect::<Vec<_>>().join(",")
}

/// A number as STEP spells it: always with a point, its exponent after a capital E.
struct Real(f64);

impl std::fmt::Display for Real {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let text = format!("{:?}", self.0);
        match text.split_once('e') {
            Some((mantissa, exponent)) if mantissa.contains('.') => write!(f, "{mantissa}E{exponent}"),
            Some((mantissa, exponent)) => write!(f, "{mantissa}.E{exponent}"),
            None => write!(f, "{text}"),
        }
    }
}
