//! Drawings as STEP: every part one solid, made once, and an assembly of as many instances of each as there are; flanks as cubic
//! splines, swept along z.
//!
//! A prism needs a few kinds of record only: planes, cylinders and extruded splines, and what joins them; a ball is two halves of a
//! sphere. They are those of ISO 10303-214 (`AUTOMOTIVE_DESIGN`).

use std::fmt::Write as _;
use std::io::{self, Write};

use super::answer::{BodyAnswer, BodyPart, BodySolid, DrawingAnswer, EdgeAnswer, OutlineAnswer, PlacementAnswer};
use super::svg;
use crate::json;

/// How far a spline may be from its curve, as a share of the chord tolerance. A spline through few points is as near to the curve
/// as chords through many, so points are left out as long as this holds.
const SPLINE_SHARE_OF_CHORD: f64 = 0.01;

/// Spans of a spline for each face that stands on it. CAD kernels sum volumes with a fixed number of places on a face:
/// OpenCascade with nine, which over a whole tooth space miss its volume by 1e-5 (tests/freecad/test_step.py). More faces make larger files.
const SPANS_OF_A_FACE: usize = 6;

/// Digits of the design's hash in the names of parts: enough to tell designs apart in a tree, few enough to be read there.
const HASH_DIGITS: usize = 8;

/// Writes a drawing.
///
/// # Errors
/// Those of the writer.
pub(super) fn write(drawing: &DrawingAnswer, writer: &mut dyn Write) -> io::Result<()> {
    let mut step = Step { writer, last: 0, spline_tolerance_mm: SPLINE_SHARE_OF_CHORD * drawing.chord_tolerance_mm };
    step.head(drawing)?;
    let frame = step.frame()?;
    let hash = drawing.design_hash.get(..HASH_DIGITS).unwrap_or_default();
    let mut components = Vec::new();
    for body in &drawing.bodies {
        components.push((body, step.part(body, hash, &frame)?));
    }
    let stands_alone = matches!(&drawing.bodies[..], [body] if body.placements[..] == [PlacementAnswer::default()]);
    if !stands_alone {
        step.assembly(&format!("{} {hash}", json::word(&drawing.subject)), &components, &frame)?;
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
    Line {
        end: [f64; 2],
    },
    /// Around the origin.
    Arc {
        end: [f64; 2],
        radius_mm: f64,
        is_counter_clockwise: bool,
    },
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
    /// What lies under each edge.
    curves: Vec<Id>,
}

/// What others refer to of a product.
struct Product {
    definition: Id,
    representation: Id,
}

/// The file as it is written: numbered records.
struct Step<'a> {
    writer: &'a mut dyn Write,
    last: u64,
    spline_tolerance_mm: f64,
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

    /// A part, made once where its section is drawn.
    fn part(&mut self, body: &BodyAnswer, hash: &str, frame: &Frame) -> io::Result<Product> {
        let (name, [red, green, blue]) = match body.part {
            BodyPart::WaveGenerator => ("wave_generator", [0.33, 0.62, 0.84]),
            BodyPart::Teeth => ("tooth", [0.94, 0.95, 0.96]),
            BodyPart::Ring => ("ring", [0.55, 0.62, 0.70]),
            BodyPart::Carrier => ("carrier_finger", [0.93, 0.72, 0.33]),
        };
        let name = format!("{name} {hash}");
        let solid = match (body.solid, &body.outer) {
            (BodySolid::Ball, OutlineAnswer::Circle { radius_mm }) => {
                self.ball(*radius_mm, 0.5 * body.width_mm, &name)?
            }
            _ => self.prism(body, &name)?,
        };
        let Frame { units, origin, .. } = frame;
        let representation =
            self.record(format_args!("ADVANCED_BREP_SHAPE_REPRESENTATION('{name}',({origin},{solid}),{units})"))?;
        let colour = self.record(format_args!("COLOUR_RGB('',{},{},{})", Real(red), Real(green), Real(blue)))?;
        let mut style = self.record(format_args!("FILL_AREA_STYLE_COLOUR('',{colour})"))?;
        for (kind, arguments) in
            [("FILL_AREA_STYLE", "'',("), ("SURFACE_STYLE_FILL_AREA", ""), ("SURFACE_SIDE_STYLE", "'',(")]
        {
            let end = if arguments.is_empty() { "" } else { ")" };
            style = self.record(format_args!("{kind}({arguments}{style}{end})"))?;
        }
        let usage = self.record(format_args!("SURFACE_STYLE_USAGE(.BOTH.,{style})"))?;
        let assignment = self.record(format_args!("PRESENTATION_STYLE_ASSIGNMENT(({usage}))"))?;
        let styled = self.record(format_args!("STYLED_ITEM('colour',({assignment}),{solid})"))?;
        self.record(format_args!("MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION('',({styled}),{units})"))?;
        self.product(&name, representation, frame)
    }

    /// What names a shape.
    fn product(&mut self, name: &str, representation: Id, frame: &Frame) -> io::Result<Product> {
        let Frame { product_context, definition_context, .. } = frame;
        let product = self.record(format_args!("PRODUCT('{name}','{name}','',({product_context}))"))?;
        self.record(format_args!("PRODUCT_RELATED_PRODUCT_CATEGORY('part',$,({product}))"))?;
        let formation = self.record(format_args!("PRODUCT_DEFINITION_FORMATION('','',{product})"))?;
        let definition =
            self.record(format_args!("PRODUCT_DEFINITION('design','',{formation},{definition_context})"))?;
        let shape = self.record(format_args!("PRODUCT_DEFINITION_SHAPE('','',{definition})"))?;
        self.record(format_args!("SHAPE_DEFINITION_REPRESENTATION({shape},{representation})"))?;
        Ok(Product { definition, representation })
    }

    /// The parts in place: of each as many instances as there are placements.
    fn assembly(&mut self, name: &str, components: &[(&BodyAnswer, Product)], frame: &Frame) -> io::Result<()> {
        let Frame { units, origin, .. } = frame;
        let mut places = Vec::new();
        for (body, _) in components {
            let mut of_body = Vec::new();
            for PlacementAnswer { x_mm, y_mm, rotation_deg } in &body.placements {
                let (sin, cos) = rotation_deg.to_radians().sin_cos();
                of_body.push(self.placement([*x_mm, *y_mm, 0.0], [0.0, 0.0, 1.0], [cos, sin, 0.0])?);
            }
            places.push(of_body);
        }
        let items = list(&places.concat());
        let representation = self.record(format_args!("SHAPE_REPRESENTATION('{name}',({origin},{items}),{units})"))?;
        let whole = self.product(name, representation, frame)?;
        for ((body, part), places) in components.iter().zip(places) {
            let part_name = json::word(&body.part);
            for (index, place) in places.into_iter().enumerate() {
                let use_name = format!("{part_name} {index}");
                let (of_whole, of_part) = (whole.definition, part.definition);
                let occurrence = self.record(format_args!(
                    "NEXT_ASSEMBLY_USAGE_OCCURRENCE('{use_name}','{use_name}','',{of_whole},{of_part},$)"
                ))?;
                let shape = self.record(format_args!("PRODUCT_DEFINITION_SHAPE('','',{occurrence})"))?;
                let motion = self.record(format_args!("ITEM_DEFINED_TRANSFORMATION('','',{origin},{place})"))?;
                let (of_whole, of_part) = (whole.representation, part.representation);
                let relation = self.record(format_args!(
                    "(REPRESENTATION_RELATIONSHIP('','',{of_part},{of_whole})REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION({motion})SHAPE_REPRESENTATION_RELATIONSHIP())"
                ))?;
                self.record(format_args!("CONTEXT_DEPENDENT_SHAPE_REPRESENTATION({relation},{shape})"))?;
            }
        }
        Ok(())
    }

    /// A prism from z = 0 up: a face on every edge, a bottom and a top.
    fn prism(&mut self, body: &BodyAnswer, name: &str) -> io::Result<Id> {
        let tolerance_mm = self.spline_tolerance_mm;
        let outer = (sides(&body.outer, false, tolerance_mm), "FACE_OUTER_BOUND");
        let holes = body.holes.iter().map(|hole| (sides(hole, true, tolerance_mm), "FACE_BOUND"));
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

    /// A ball around a place on the z axis: two halves that meet along a great circle through its poles.
    fn ball(&mut self, radius_mm: f64, center_z_mm: f64, name: &str) -> io::Result<Id> {
        let (center, y) = ([0.0, 0.0, center_z_mm], [0.0, 1.0, 0.0]);
        let place = self.placement(center, [0.0, 0.0, 1.0], [1.0, 0.0, 0.0])?;
        let sphere = self.record(format_args!("SPHERICAL_SURFACE('',{place},{})", Real(radius_mm)))?;
        let mut poles = Vec::new();
        for z_mm in [center_z_mm - radius_mm, center_z_mm + radius_mm] {
            let point = self.point([0.0, 0.0, z_mm])?;
            poles.push(self.record(format_args!("VERTEX_POINT('',{point})"))?);
        }
        // Each from the lower pole to the upper one, through +x and through -x.
        let mut meridians = Vec::new();
        for x in [1.0, -1.0] {
            let place = self.placement(center, y.map(|y| -x * y), [x, 0.0, 0.0])?;
            let circle = self.record(format_args!("CIRCLE('',{place},{})", Real(radius_mm)))?;
            meridians.push(self.record(format_args!("EDGE_CURVE('',{},{},{circle},.T.)", poles[0], poles[1]))?);
        }
        let mut faces = Vec::new();
        // Seen from outside the half towards -y has +x on its right, so that it runs up along +x; the other one runs up along -x.
        for (up, down) in [(meridians[0], meridians[1]), (meridians[1], meridians[0])] {
            let around = self.edge_loop([(up, true), (down, false)])?;
            let bound = self.record(format_args!("FACE_OUTER_BOUND('',{around},.T.)"))?;
            faces.push(self.record(format_args!("ADVANCED_FACE('',({bound}),{sphere},.T.)"))?);
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
        let (mut edges, mut curves) = (Vec::new(), Vec::new());
        for (index, side) in sides.iter().enumerate() {
            let start = sides[(index + sides.len() - 1) % sides.len()].end();
            let (curve, runs_along) = self.curve(side, start, z_mm)?;
            curves.push(curve);
            let (from, to) = (corners[index], corners[(index + 1) % corners.len()]);
            edges.push(self.record(format_args!("EDGE_CURVE('',{from},{to},{curve},{runs_along})"))?);
        }
        Ok(Level { z_mm, corners, edges, curves })
    }

    /// The curve under an edge, and whether the edge runs along it.
    fn curve(&mut self, side: &Side, start: [f64; 2], z_mm: f64) -> io::Result<(Id, &'static str)> {
        match side {
            Side::Line { end } => {
                let point = self.point([start[0], start[1], z_mm])?;
                let [x, y] = unit([end[0] - start[0], end[1] - start[1]]);
                Ok((self.line(point, [x, y, 0.0])?, ".T."))
            }
            Side::Arc { radius_mm, is_counter_clockwise, .. } => {
                let place = self.placement([0.0, 0.0, z_mm], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0])?;
                let circle = self.record(format_args!("CIRCLE('',{place},{})", Real(*radius_mm)))?;
                Ok((circle, if *is_counter_clockwise { ".T." } else { ".F." }))
            }
            Side::Curve(Spline { poles, multiplicities, knots }) => {
                let poles: Vec<_> = poles.iter().map(|[x, y]| self.point([*x, *y, z_mm])).collect::<Result<_, _>>()?;
                let spline = self.record(format_args!(
                    "B_SPLINE_CURVE_WITH_KNOTS('',3,({}),.UNSPECIFIED.,.F.,.F.,({multiplicities}),({knots}),.UNSPECIFIED.)",
                    list(&poles)
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
            let (surface, faces_outward) = self.surface(side, start, bottom, bottom.curves[index])?;
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

    /// The surface over an edge, and whether its normal points out of the material, to the right of the edge.
    fn surface(&mut self, side: &Side, start: [f64; 2], bottom: &Level, curve: Id) -> io::Result<(Id, &'static str)> {
        match side {
            Side::Line { end } => {
                let [x, y] = unit([end[0] - start[0], end[1] - start[1]]);
                let place = self.placement([start[0], start[1], bottom.z_mm], [y, -x, 0.0], [x, y, 0.0])?;
                Ok((self.record(format_args!("PLANE('',{place})"))?, ".T."))
            }
            Side::Arc { radius_mm, is_counter_clockwise, .. } => {
                let place = self.placement([0.0, 0.0, bottom.z_mm], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0])?;
                let cylinder = self.record(format_args!("CYLINDRICAL_SURFACE('',{place},{})", Real(*radius_mm)))?;
                // A cylinder's normal points away from its axis.
                Ok((cylinder, if *is_counter_clockwise { ".T." } else { ".F." }))
            }
            Side::Curve(_) => {
                let up = self.direction([0.0, 0.0, 1.0])?;
                let sweep = self.record(format_args!("VECTOR('',{up},1.)"))?;
                // Its normal is that of the curve's direction times z.
                Ok((self.record(format_args!("SURFACE_OF_LINEAR_EXTRUSION('',{curve},{sweep})"))?, ".T."))
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
fn sides(outline: &OutlineAnswer, is_hole: bool, tolerance_mm: f64) -> Vec<Side> {
    let mut sides: Vec<_> = match outline {
        OutlineAnswer::Circle { radius_mm } => {
            let half = |x: f64| Side::Arc { end: [x, 0.0], radius_mm: *radius_mm, is_counter_clockwise: !is_hole };
            // Halves, because an edge from a corner to itself is not every reader's strength. A hole's are the same ones.
            return vec![half(-radius_mm), half(*radius_mm)];
        }
        OutlineAnswer::Path { edges } => edges
            .iter()
            .flat_map(|edge| {
                let end = if is_hole { edge.start() } else { edge.end() };
                match edge {
                    EdgeAnswer::Line { .. } => vec![Side::Line { end }],
                    EdgeAnswer::Arc { radius_mm, sweep_deg, .. } => {
                        let is_counter_clockwise = (*sweep_deg > 0.0) != is_hole;
                        vec![Side::Arc { end, radius_mm: *radius_mm, is_counter_clockwise }]
                    }
                    EdgeAnswer::Curve { x_mm, y_mm, start_tangent_deg, end_tangent_deg } => {
                        let mut points: Vec<_> = x_mm.iter().zip(y_mm).map(|(&x, &y)| [x, y]).collect();
                        let direction = |deg: &f64| {
                            let (sin, cos) = deg.to_radians().sin_cos();
                            if is_hole { [-cos, -sin] } else { [cos, sin] }
                        };
                        let mut end_tangents = [direction(start_tangent_deg), direction(end_tangent_deg)];
                        if is_hole {
                            points.reverse();
                            end_tangents.reverse();
                        }
                        let mut pieces: Vec<_> = Interpolation::near(&points, &end_tangents, tolerance_mm)
                            .cut()
                            .iter()
                            .map(|piece| Side::Curve(Spline::of(piece)))
                            .collect();
                        if is_hole {
                            pieces.reverse();
                        }
                        pieces
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

/// A cubic spline through points: of two continuous derivatives over the length of the chords, with unit tangents at both ends.
/// It leaves the curve by the fourth power of the chord.
struct Interpolation {
    points: Vec<[f64; 2]>,
    chords_mm: Vec<f64>,
    slopes: Vec<[f64; 2]>,
}

impl Interpolation {
    fn through(points: Vec<[f64; 2]>, end_tangents: &[[f64; 2]; 2]) -> Self {
        let chords_mm: Vec<f64> =
            points.windows(2).map(|two| (two[1][0] - two[0][0]).hypot(two[1][1] - two[0][1])).collect();
        let [along_x, along_y] = [0, 1].map(|axis| {
            let column: Vec<f64> = points.iter().map(|point| point[axis]).collect();
            slopes(&column, &chords_mm, end_tangents[0][axis], end_tangents[1][axis])
        });
        let slopes = along_x.into_iter().zip(along_y).map(|(x, y)| [x, y]).collect();
        Self { points, chords_mm, slopes }
    }

    /// Through as few of the points of a curve as it takes to pass all others within a tolerance: pieces that do not are halved.
    fn near(points: &[[f64; 2]], end_tangents: &[[f64; 2]; 2], tolerance_mm: f64) -> Self {
        let mut kept = vec![0, points.len() - 1];
        loop {
            let spline = Interpolation::through(kept.iter().map(|&index| points[index]).collect(), end_tangents);
            let mut next = vec![0];
            for (piece, ends) in kept.windows(2).enumerate() {
                let (from, to) = (ends[0], ends[1]);
                if points[from + 1..to].iter().any(|&point| spline.distance_mm(piece, point) > tolerance_mm) {
                    next.push(from.midpoint(to));
                }
                next.push(to);
            }
            if next.len() == kept.len() {
                return spline;
            }
            kept = next;
        }
    }

    /// The same curve in pieces, one for each face.
    fn cut(&self) -> Vec<Self> {
        let spans = self.chords_mm.len();
        let pieces = (spans / SPANS_OF_A_FACE).max(1);
        let ends = |piece: usize| spans * piece / pieces;
        let piece = |from: usize, to: usize| Self {
            points: self.points[from..=to].to_vec(),
            chords_mm: self.chords_mm[from..to].to_vec(),
            slopes: self.slopes[from..=to].to_vec(),
        };
        (0..pieces).map(|index| piece(ends(index), ends(index + 1))).collect()
    }

    /// Bézier's polygon of a piece: its inner points a third of the chord from the ends, along the slopes there.
    fn polygon(&self, piece: usize) -> [[f64; 2]; 4] {
        let third_mm = self.chords_mm[piece] / 3.0;
        let after = |i: usize, mm: f64| [0, 1].map(|axis| self.points[i][axis] + mm * self.slopes[i][axis]);
        [self.points[piece], after(piece, third_mm), after(piece + 1, -third_mm), self.points[piece + 1]]
    }

    /// How far a point that is near to a piece is from it.
    fn distance_mm(&self, piece: usize, [x, y]: [f64; 2]) -> f64 {
        let [p, q, r, s] = self.polygon(piece);
        let between = |a: [f64; 2], b: [f64; 2], t: f64| [0, 1].map(|axis| a[axis] + t * (b[axis] - a[axis]));
        // The point on the piece at a share of it, and the derivative there, by de Casteljau.
        let at = |t: f64| {
            let (pq, qr, rs) = (between(p, q, t), between(q, r, t), between(r, s, t));
            let (first, last) = (between(pq, qr, t), between(qr, rs, t));
            (between(first, last, t), [0, 1].map(|axis| 3.0 * (last[axis] - first[axis])))
        };
        let chord = [s[0] - p[0], s[1] - p[1]];
        let mut t = ((x - p[0]) * chord[0] + (y - p[1]) * chord[1]) / (chord[0] * chord[0] + chord[1] * chord[1]);
        // Gauss and Newton: every step squares the error of the foot, and the error of the distance is its square again.
        for _ in 0..4 {
            let (foot, along) = at(t);
            t += ((x - foot[0]) * along[0] + (y - foot[1]) * along[1]) / (along[0] * along[0] + along[1] * along[1]);
        }
        let (foot, _) = at(t);
        (x - foot[0]).hypot(y - foot[1])
    }
}

/// A cubic spline as STEP has it.
struct Spline {
    poles: Vec<[f64; 2]>,
    multiplicities: String,
    knots: String,
}

impl Spline {
    fn of(spline: &Interpolation) -> Self {
        let Interpolation { points, chords_mm, .. } = spline;
        let last = chords_mm.len();
        let mut poles = vec![points[0], spline.polygon(0)[1]];
        for i in 1..last {
            // Blossoming: the pole of three knots in a row lies on the line through the inner points of the piece after the middle one.
            let ([_, first, second, _], ratio) = (spline.polygon(i), chords_mm[i - 1] / chords_mm[i]);
            poles.push([0, 1].map(|axis| first[axis] - ratio * (second[axis] - first[axis])));
        }
        poles.extend([spline.polygon(last - 1)[2], points[last]]);
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
