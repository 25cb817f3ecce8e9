//! Drawings as STEP: each part is one solid, and the assembly has an instance for each placement. Flanks are
//! polynomials, extruded along z. Each polynomial is a face, since CAD kernels integrate its volume exactly, but not
//! that of a spline of several.
//!
//! A prism needs few kinds of record: planes, cylinders, extruded polynomials, and their topology. A ball is two halves
//! of a sphere. The records are those of ISO 10303-214 (`AUTOMOTIVE_DESIGN`).

use std::collections::HashMap;
use std::io::{self, Write};

use toothwave_solver::Part;
use toothwave_solver::drawing::{Body, BodySolid, Edge, Outline, Placement};
use toothwave_solver::profile::Polyline;

use super::DrawingAnswer;
use super::svg;
use crate::json;

/// Digits of the design's hash in the names of parts: enough to distinguish designs, few enough to read in a tree view.
const HASH_DIGITS: usize = 8;

pub(super) fn write(drawing: &DrawingAnswer, writer: &mut dyn Write) -> io::Result<()> {
    let mut step = Step { writer, last: FRAME_RECORDS, shared: HashMap::new() };
    step.head(drawing)?;
    let origin = step.placement([0.0; 3], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0])?;
    let hash = drawing.design_hash.get(..HASH_DIGITS).unwrap_or_default();
    let mut components = Vec::new();
    for body in &drawing.bodies {
        components.push((body, step.part(body, hash, origin)?));
    }
    let stands_alone = matches!(&drawing.bodies[..], [body] if body.placements[..] == [Placement::default()]);
    if !stands_alone {
        step.assembly(&format!("{} {hash}", json::word(&drawing.subject)), &components, origin)?;
    }
    writeln!(step.writer, "ENDSEC;\nEND-ISO-10303-21;")
}

/// Resolution of points: one picometre, 1e-4 of the distance between a curve and its polynomials at the default chord
/// tolerance.
const LEAST_PER_MM: f64 = 1e9;

/// Number of a record.
#[derive(Debug, Clone, Copy)]
struct Id(u64);

impl std::fmt::Display for Id {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "#{}", self.0)
    }
}

/// Records that all products refer to, from #1.
const FRAME: &str = "\
#1=APPLICATION_CONTEXT('core data for automotive mechanical design processes');
#2=APPLICATION_PROTOCOL_DEFINITION('international standard','automotive_design',2000,#1);
#3=PRODUCT_CONTEXT('',#1,'mechanical');
#4=PRODUCT_DEFINITION_CONTEXT('part definition',#1,'design');
#5=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));
#6=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));
#7=(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT());
#8=UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-7),#5,'distance_accuracy_value','how near points are the same');
#9=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#8))GLOBAL_UNIT_ASSIGNED_CONTEXT((#5,#6,#7))REPRESENTATION_CONTEXT('',''));";
const FRAME_RECORDS: u64 = 9;
const PRODUCT_CONTEXT: Id = Id(3);
const DEFINITION_CONTEXT: Id = Id(4);
const UNITS: Id = Id(9);

/// Edge of the bottom of a prism: counter-clockwise around the material, which is on its left.
struct Side {
    start: [f64; 2],
    end: [f64; 2],
    shape: Shape,
}

enum Shape {
    Line,
    Arc {
        center: [f64; 2],
        radius_mm: f64,
        is_counter_clockwise: bool,
    },
    /// A polynomial, by its Bézier control polygon.
    Curve(Vec<[f64; 2]>),
}

/// Corners and edges of one loop at one height.
struct Level {
    corners: Vec<Id>,
    edges: Vec<Id>,
    /// Curve under each edge.
    curves: Vec<Id>,
}

/// Records of a product that others refer to.
struct Product {
    definition: Id,
    representation: Id,
}

/// Writer of the file: numbered records.
struct Step<'a> {
    writer: &'a mut dyn Write,
    last: u64,
    /// Points, directions and vectors; each is written once.
    shared: HashMap<String, Id>,
}

impl Step<'_> {
    fn record(&mut self, text: std::fmt::Arguments<'_>) -> io::Result<Id> {
        self.last += 1;
        writeln!(self.writer, "#{}={text};", self.last)?;
        Ok(Id(self.last))
    }

    /// Writes a record that is only a value. Equal values share one record.
    fn shared(&mut self, text: String) -> io::Result<Id> {
        if let Some(&id) = self.shared.get(&text) {
            return Ok(id);
        }
        let id = self.record(format_args!("{text}"))?;
        self.shared.insert(text, id);
        Ok(id)
    }

    fn head(&mut self, drawing: &DrawingAnswer) -> io::Result<()> {
        let title = svg::title(drawing);
        // The same design gives the same bytes at any time, so the date is constant.
        writeln!(
            self.writer,
            "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION(('{title}'),'2;1');\nFILE_NAME('{title}','1970-01-01T00:00:00',(''),(''),'toothwave {}','toothwave','');\nFILE_SCHEMA(('AUTOMOTIVE_DESIGN {{ 1 0 10303 214 1 1 1 1 }}'));\nENDSEC;\nDATA;\n{FRAME}",
            drawing.solver_version
        )
    }

    /// Writes a part once, at its original position.
    fn part(&mut self, body: &Body, hash: &str, origin: Id) -> io::Result<Product> {
        let (name, [red, green, blue]) = match body.part {
            Part::WaveGenerator => ("wave_generator", [0.33, 0.62, 0.84]),
            Part::Teeth => ("tooth", [0.94, 0.95, 0.96]),
            Part::Ring => ("ring", [0.55, 0.62, 0.70]),
            Part::Carrier => ("carrier_finger", [0.93, 0.72, 0.33]),
        };
        let name = format!("{name} {hash}");
        let solid = match (body.solid, &body.outer) {
            (BodySolid::Ball, Outline::Circle { radius_mm }) => self.ball(*radius_mm, 0.5 * body.width_mm, &name)?,
            _ => self.prism(body, &name)?,
        };
        let representation =
            self.record(format_args!("ADVANCED_BREP_SHAPE_REPRESENTATION('{name}',({origin},{solid}),{UNITS})"))?;
        let colour = self.record(format_args!("COLOUR_RGB('',{},{},{})", Real(red), Real(green), Real(blue)))?;
        let style = self.record(format_args!("FILL_AREA_STYLE_COLOUR('',{colour})"))?;
        let style = self.record(format_args!("FILL_AREA_STYLE('',({style}))"))?;
        let style = self.record(format_args!("SURFACE_STYLE_FILL_AREA({style})"))?;
        let style = self.record(format_args!("SURFACE_SIDE_STYLE('',({style}))"))?;
        let usage = self.record(format_args!("SURFACE_STYLE_USAGE(.BOTH.,{style})"))?;
        let assignment = self.record(format_args!("PRESENTATION_STYLE_ASSIGNMENT(({usage}))"))?;
        let styled = self.record(format_args!("STYLED_ITEM('colour',({assignment}),{solid})"))?;
        self.record(format_args!("MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION('',({styled}),{UNITS})"))?;
        self.product(&name, representation)
    }

    /// Writes the records that name a shape.
    fn product(&mut self, name: &str, representation: Id) -> io::Result<Product> {
        let product = self.record(format_args!("PRODUCT('{name}','{name}','',({PRODUCT_CONTEXT}))"))?;
        self.record(format_args!("PRODUCT_RELATED_PRODUCT_CATEGORY('part',$,({product}))"))?;
        let formation = self.record(format_args!("PRODUCT_DEFINITION_FORMATION('','',{product})"))?;
        let definition =
            self.record(format_args!("PRODUCT_DEFINITION('design','',{formation},{DEFINITION_CONTEXT})"))?;
        let shape = self.record(format_args!("PRODUCT_DEFINITION_SHAPE('','',{definition})"))?;
        self.record(format_args!("SHAPE_DEFINITION_REPRESENTATION({shape},{representation})"))?;
        Ok(Product { definition, representation })
    }

    /// Writes the placed parts, with one instance for each placement.
    fn assembly(&mut self, name: &str, components: &[(&Body, Product)], origin: Id) -> io::Result<()> {
        let mut places = Vec::new();
        for (body, _) in components {
            let mut of_body = Vec::new();
            for Placement { x_mm, y_mm, rotation_deg } in &body.placements {
                let (sin, cos) = rotation_deg.to_radians().sin_cos();
                of_body.push(self.placement([*x_mm, *y_mm, 0.0], [0.0, 0.0, 1.0], [cos, sin, 0.0])?);
            }
            places.push(of_body);
        }
        let items = list(&places.concat());
        let representation = self.record(format_args!("SHAPE_REPRESENTATION('{name}',({origin},{items}),{UNITS})"))?;
        let whole = self.product(name, representation)?;
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

    /// Writes a prism from z = 0 upward: a face on every edge, a bottom and a top.
    fn prism(&mut self, body: &Body, name: &str) -> io::Result<Id> {
        let outer = (sides(&body.outer, false), "FACE_OUTER_BOUND");
        let holes = body.holes.iter().map(|hole| (sides(hole, true), "FACE_BOUND"));
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

    /// Writes a ball around a point on the z axis: two halves that meet along a great circle through its poles.
    fn ball(&mut self, radius_mm: f64, center_z_mm: f64, name: &str) -> io::Result<Id> {
        let (center, y) = ([0.0, 0.0, center_z_mm], [0.0, 1.0, 0.0]);
        let place = self.placement(center, [0.0, 0.0, 1.0], [1.0, 0.0, 0.0])?;
        let sphere = self.record(format_args!("SPHERICAL_SURFACE('',{place},{})", Real(radius_mm)))?;
        let mut poles = Vec::new();
        for z_mm in [center_z_mm - radius_mm, center_z_mm + radius_mm] {
            let point = self.point([0.0, 0.0, z_mm])?;
            poles.push(self.record(format_args!("VERTEX_POINT('',{point})"))?);
        }
        // Each runs from the lower pole to the upper one, through +x and through -x.
        let mut meridians = Vec::new();
        for x in [1.0, -1.0] {
            let place = self.placement(center, y.map(|y| -x * y), [x, 0.0, 0.0])?;
            let circle = self.record(format_args!("CIRCLE('',{place},{})", Real(radius_mm)))?;
            meridians.push(self.record(format_args!("EDGE_CURVE('',{},{},{circle},.T.)", poles[0], poles[1]))?);
        }
        let mut faces = Vec::new();
        // Seen from outside, the half towards -y has +x on its right, so it runs up along +x. The other half runs up
        // along -x.
        for (up, down) in [(meridians[0], meridians[1]), (meridians[1], meridians[0])] {
            let around = self.edge_loop([(up, true), (down, false)])?;
            let bound = self.record(format_args!("FACE_OUTER_BOUND('',{around},.T.)"))?;
            faces.push(self.record(format_args!("ADVANCED_FACE('',({bound}),{sphere},.T.)"))?);
        }
        let shell = self.record(format_args!("CLOSED_SHELL('',({}))", list(&faces)))?;
        self.record(format_args!("MANIFOLD_SOLID_BREP('{name}',{shell})"))
    }

    /// Writes the corners of a loop at a height, and the edges between them.
    fn level(&mut self, sides: &[Side], z_mm: f64) -> io::Result<Level> {
        let mut corners = Vec::new();
        for &Side { end: [x, y], .. } in sides {
            let point = self.point([x, y, z_mm])?;
            corners.push(self.record(format_args!("VERTEX_POINT('',{point})"))?);
        }
        // Each side ends at the corner of its index and starts at the previous one.
        corners.rotate_right(1);
        let (mut edges, mut curves) = (Vec::new(), Vec::new());
        for (index, side) in sides.iter().enumerate() {
            let (curve, runs_along) = self.curve(side, z_mm)?;
            curves.push(curve);
            let (from, to) = (corners[index], corners[(index + 1) % corners.len()]);
            edges.push(self.record(format_args!("EDGE_CURVE('',{from},{to},{curve},{runs_along})"))?);
        }
        Ok(Level { corners, edges, curves })
    }

    /// Writes the curve under an edge. Returns it and `.T.` if the edge has the same direction.
    fn curve(&mut self, Side { start, end, shape }: &Side, z_mm: f64) -> io::Result<(Id, &'static str)> {
        match shape {
            Shape::Line => {
                let point = self.point([start[0], start[1], z_mm])?;
                let [x, y] = direction(*start, *end);
                Ok((self.line(point, [x, y, 0.0])?, ".T."))
            }
            Shape::Arc { center: [x, y], radius_mm, is_counter_clockwise } => {
                let place = self.placement([*x, *y, z_mm], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0])?;
                let circle = self.record(format_args!("CIRCLE('',{place},{})", Real(*radius_mm)))?;
                Ok((circle, if *is_counter_clockwise { ".T." } else { ".F." }))
            }
            Shape::Curve(poles) => {
                let poles: Vec<_> = poles.iter().map(|[x, y]| self.point([*x, *y, z_mm])).collect::<Result<_, _>>()?;
                let order = poles.len();
                let spline = self.record(format_args!(
                    "B_SPLINE_CURVE_WITH_KNOTS('',{},({}),.UNSPECIFIED.,.F.,.F.,({order},{order}),(0.,1.),.UNSPECIFIED.)",
                    order - 1,
                    list(&poles)
                ))?;
                Ok((spline, ".T."))
            }
        }
    }

    /// Writes the faces on the edges of a loop. Seen from outside, each runs along the bottom, up, back and down.
    fn walls(&mut self, sides: &[Side], bottom: &Level, top: &Level) -> io::Result<Vec<Id>> {
        let mut uprights = Vec::new();
        for (side, (&from, &to)) in sides.iter().zip(bottom.corners.iter().zip(&top.corners)) {
            let point = self.point([side.start[0], side.start[1], 0.0])?;
            let line = self.line(point, [0.0, 0.0, 1.0])?;
            uprights.push(self.record(format_args!("EDGE_CURVE('',{from},{to},{line},.T.)"))?);
        }
        let mut faces = Vec::new();
        for (index, side) in sides.iter().enumerate() {
            let (surface, faces_outward) = self.surface(side, bottom.curves[index])?;
            let around = self.edge_loop([
                (bottom.edges[index], true),
                (uprights[(index + 1) % sides.len()], true),
                (top.edges[index], false),
                (uprights[index], false),
            ])?;
            let bound = self.record(format_args!("FACE_OUTER_BOUND('',{around},.T.)"))?;
            faces.push(self.record(format_args!("ADVANCED_FACE('',({bound}),{surface},{faces_outward})"))?);
        }
        Ok(faces)
    }

    /// Writes the surface over an edge of the bottom. Returns it and `.T.` if its normal points out of the material, to
    /// the right of the edge.
    fn surface(&mut self, Side { start, end, shape }: &Side, curve: Id) -> io::Result<(Id, &'static str)> {
        match shape {
            Shape::Line => {
                let [x, y] = direction(*start, *end);
                let place = self.placement([start[0], start[1], 0.0], [y, -x, 0.0], [x, y, 0.0])?;
                Ok((self.record(format_args!("PLANE('',{place})"))?, ".T."))
            }
            Shape::Arc { center: [x, y], radius_mm, is_counter_clockwise } => {
                let place = self.placement([*x, *y, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0])?;
                let cylinder = self.record(format_args!("CYLINDRICAL_SURFACE('',{place},{})", Real(*radius_mm)))?;
                // A cylinder's normal points away from its axis.
                Ok((cylinder, if *is_counter_clockwise { ".T." } else { ".F." }))
            }
            Shape::Curve(_) => {
                let sweep = self.vector([0.0, 0.0, 1.0])?;
                // The normal is the curve's direction times z.
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
        let vector = self.vector(direction)?;
        self.record(format_args!("LINE('',{point},{vector})"))
    }

    /// Writes a unit vector.
    fn vector(&mut self, direction: [f64; 3]) -> io::Result<Id> {
        let direction = self.direction(direction)?;
        self.shared(format!("VECTOR('',{direction},1.)"))
    }

    fn placement(&mut self, origin: [f64; 3], z: [f64; 3], x: [f64; 3]) -> io::Result<Id> {
        let (origin, z, x) = (self.point(origin)?, self.direction(z)?, self.direction(x)?);
        self.record(format_args!("AXIS2_PLACEMENT_3D('',{origin},{z},{x})"))
    }

    fn point(&mut self, position_mm: [f64; 3]) -> io::Result<Id> {
        let [x, y, z] = position_mm.map(|mm| Real((mm * LEAST_PER_MM).round() / LEAST_PER_MM));
        self.shared(format!("CARTESIAN_POINT('',({x},{y},{z}))"))
    }

    fn direction(&mut self, direction: [f64; 3]) -> io::Result<Id> {
        let [x, y, z] = direction.map(Real);
        self.shared(format!("DIRECTION('',({x},{y},{z}))"))
    }
}

/// Returns the sides of a prism over an outline. Those of a hole run clockwise, so the material is on their left too.
fn sides(outline: &Outline, is_hole: bool) -> Vec<Side> {
    let arc = |center, radius_mm, runs_forward| {
        let is_counter_clockwise = runs_forward != is_hole;
        Shape::Arc { center, radius_mm, is_counter_clockwise }
    };
    let curve = |poles: &Polyline| {
        let mut poles: Vec<[f64; 2]> = poles.iter().map(|&pole| pole.into()).collect();
        if is_hole {
            poles.reverse();
        }
        (poles.last().copied().unwrap_or_default(), Shape::Curve(poles))
    };
    let shapes: Vec<([f64; 2], Shape)> = match outline {
        // Two halves, because some readers do not support an edge from a corner to itself. A hole has the same halves.
        Outline::Circle { radius_mm } => {
            [-radius_mm, *radius_mm].map(|x| ([x, 0.0], arc([0.0; 2], *radius_mm, true))).into()
        }
        Outline::Path { edges } => {
            let shapes = edges.iter().flat_map(|edge| {
                let end = if is_hole { edge.start() } else { edge.end() };
                match edge {
                    Edge::Line { .. } => vec![(end, Shape::Line)],
                    Edge::Arc { center_mm, radius_mm, sweep_deg, .. } => {
                        vec![(end, arc(*center_mm, *radius_mm, *sweep_deg > 0.0))]
                    }
                    Edge::Curve { polynomials, .. } => polynomials.iter().map(curve).collect(),
                }
            });
            if is_hole { shapes.rev().collect() } else { shapes.collect() }
        }
    };
    let ends: Vec<_> = shapes.iter().map(|(end, _)| *end).collect();
    let starts = ends.last().into_iter().chain(&ends);
    starts.zip(shapes).map(|(&start, (end, shape))| Side { start, end, shape }).collect()
}

/// Returns the unit vector from one point towards another.
fn direction(from: [f64; 2], to: [f64; 2]) -> [f64; 2] {
    let [x, y] = [to[0] - from[0], to[1] - from[1]];
    let length = x.hypot(y);
    [x / length, y / length]
}

fn list(ids: &[Id]) -> String {
    ids.iter().map(Id::to_string).collect::<Vec<_>>().join(",")
}

/// Number in STEP notation: always with a point, its exponent after a capital E.
struct Real(f64);

impl std::fmt::Display for Real {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        // Adding zero turns -0.0 into 0.0.
        let text = format!("{:?}", self.0 + 0.0);
        let text = text.strip_suffix(".0").map_or(text.clone(), |whole| format!("{whole}."));
        match text.split_once('e') {
            Some((mantissa, exponent)) if mantissa.contains('.') => write!(f, "{mantissa}E{exponent}"),
            Some((mantissa, exponent)) => write!(f, "{mantissa}.E{exponent}"),
            None => write!(f, "{text}"),
        }
    }
}
