//! Bodies as closed meshes of triangles, for printers.
//!
//! A section lies between two parallel lines, counter-clockwise: a bore and an outline, a ring's teeth and its rim, the
//! inner and the outer arc of a finger, or a point in the middle and an outline. Rungs join the lines, with one or two
//! triangles between two rungs. Every triangle edge without a neighbour has a wall, so the mesh is closed for all
//! numbers.

use std::f64::consts::PI;

use toothwave_solver::Part;
use toothwave_solver::drawing::{Body, BodySolid, Edge, Outline};

use super::DrawingAnswer;

/// Largest number of chords of a circle. On a radius of 1 m they are within 1 nm of it.
const MOST_CHORDS: u32 = 100_000;

/// The same for a ball, which has half as many triangles as the square of this number.
const MOST_CHORDS_OF_BALL: u32 = 360;

/// Distance at which points of a line are merged, as a share of the farthest point's distance. A number in STL has
/// seven digits.
const LEAST_SHARE: f64 = 1e-6;

/// Triangles as indices into the list of points, counter-clockwise seen from outside.
pub(super) struct Mesh {
    pub(super) points_mm: Vec<[f64; 3]>,
    pub(super) triangles: Vec<[usize; 3]>,
}

/// Returns the approximate bytes of a drawing's meshes: four points and eight triangles per outline point, and as many
/// again if another line is parallel to it.
pub(super) fn held_bytes(drawing: &DrawingAnswer) -> u64 {
    const POINT_BYTES: u64 = 320;
    const BALL_BYTES: u64 = 6 << 20;
    let tolerance_mm = drawing.chord_tolerance_mm;
    let of_edge = |edge: &Edge| match edge {
        Edge::Line { .. } => 1,
        Edge::Arc { radius_mm, sweep_deg, .. } => {
            chords(sweep_deg.to_radians(), *radius_mm, tolerance_mm, MOST_CHORDS).into()
        }
        Edge::Curve { x_mm, .. } => x_mm.len() as u64,
    };
    let of_outline = |outline: &Outline| match outline {
        Outline::Circle { radius_mm } => chords(2.0 * PI, *radius_mm, tolerance_mm, MOST_CHORDS).into(),
        Outline::Path { edges } => edges.iter().map(of_edge).sum::<u64>(),
    };
    let of_body = |body: &Body| match body.solid {
        BodySolid::Ball => BALL_BYTES,
        BodySolid::Prism => POINT_BYTES * body.holes.iter().chain([&body.outer]).map(of_outline).sum::<u64>(),
    };
    drawing.bodies.iter().map(of_body).sum()
}

/// Section, divided into triangles.
#[derive(Default)]
struct Ladder {
    points: Vec<[f64; 2]>,
    /// Rungs from a point of the inner line to one of the outer line, counter-clockwise.
    rungs: Vec<[usize; 2]>,
}

impl Mesh {
    /// Divides the section of a body, at its original position, within the chord tolerance.
    pub(super) fn new(body: &Body, tolerance_mm: f64) -> Self {
        match (body.solid, &body.outer) {
            (BodySolid::Ball, Outline::Circle { radius_mm }) => {
                Self::ball(*radius_mm, 0.5 * body.width_mm, tolerance_mm)
            }
            _ => Self::prism(&Ladder::new(body, tolerance_mm), body.width_mm),
        }
    }

    /// Adds a prism from z = 0 upward.
    fn prism(Ladder { points, rungs }: &Ladder, width_mm: f64) -> Self {
        let points_mm = [0.0, width_mm].iter().flat_map(|&z| points.iter().map(move |&[x, y]| [x, y, z])).collect();
        let mut mesh = Self { points_mm, triangles: Vec::new() };
        let above = points.len();
        for pair in rungs.windows(2) {
            let ([inner, outer], [next_inner, next_outer]) = (pair[0], pair[1]);
            if outer != next_outer {
                mesh.cap([inner, outer, next_outer], above);
                mesh.wall(outer, next_outer, above);
            }
            if inner != next_inner {
                mesh.cap([inner, next_outer, next_inner], above);
                mesh.wall(next_inner, inner, above);
            }
        }
        if let [[first_inner, first_outer], .., [last_inner, last_outer]] = rungs[..]
            && first_outer != last_outer
        {
            mesh.wall(first_inner, first_outer, above);
            mesh.wall(last_outer, last_inner, above);
        }
        mesh
    }

    /// Adds a triangle of the section, at the top and at the bottom.
    fn cap(&mut self, [a, b, c]: [usize; 3], above: usize) {
        self.triangles.extend([[a + above, b + above, c + above], [a, c, b]]);
    }

    /// Adds a wall on an edge of the section, with the material on its left.
    fn wall(&mut self, from: usize, to: usize, above: usize) {
        self.triangles.extend([[from, to, to + above], [from, to + above, from + above]]);
    }

    /// Adds a ball around a point on the z axis: rows of points between its poles, with equal distances in and between
    /// the rows.
    fn ball(radius_mm: f64, center_z_mm: f64, tolerance_mm: f64) -> Self {
        // In the middle of four points the distances along both directions add up.
        let rows = chords(PI, radius_mm, 0.5 * tolerance_mm, MOST_CHORDS_OF_BALL / 2).max(2);
        let columns = 2 * rows as usize;
        let mut points_mm = Vec::new();
        for row in 0..=rows {
            let (sin, cos) = (PI * (f64::from(row) / f64::from(rows))).sin_cos();
            let [x, z] = [radius_mm * sin, center_z_mm - radius_mm * cos];
            let is_pole = row == 0 || row == rows;
            for column in 0..if is_pole { 1 } else { 2 * rows } {
                let [x, y] = turned([x, 0.0], PI * (f64::from(column) / f64::from(rows)));
                points_mm.push([x, y, z]);
            }
        }
        let top = points_mm.len() - 1;
        let mut triangles = Vec::new();
        for (column, next) in (0..columns).zip((1..columns).chain([0])) {
            triangles.push([0, 1 + next, 1 + column]);
            for below in (1..top - columns).step_by(columns) {
                let above = below + columns;
                triangles.push([below + column, below + next, above + next]);
                triangles.push([below + column, above + next, above + column]);
            }
            triangles.push([top - columns + column, top - columns + next, top]);
        }
        Self { points_mm, triangles }
    }
}

impl Ladder {
    fn new(body: &Body, tolerance_mm: f64) -> Self {
        let line = |outline: &Outline| line(outline, tolerance_mm);
        match (body.part, &body.outer, &body.holes[..]) {
            (Part::Carrier, Outline::Path { edges }, _) => Self::finger(edges, tolerance_mm),
            (_, Outline::Circle { radius_mm }, [hole]) => Self::to_circle(&line(hole), *radius_mm, tolerance_mm),
            (_, outer, [Outline::Circle { radius_mm }]) => Self::to_circle(&line(outer), *radius_mm, tolerance_mm),
            (_, outer, _) => Self::around_origin(&line(outer)),
        }
    }

    /// Fills the area between a line around the origin and a circle about it, inside or outside. The circle has a point
    /// at the angle of each point of the line, and more where its chords would be too long.
    fn to_circle(line: &[[f64; 2]], radius_mm: f64, tolerance_mm: f64) -> Self {
        let mut ladder = Self::default();
        let is_outside = line.iter().all(|[x, y]| x.hypot(*y) < radius_mm);
        for (&[x, y], [next_x, next_y]) in line.iter().zip(line.iter().cycle().skip(1)) {
            let angle_rad = (x * next_y - y * next_x).atan2(x * next_x + y * next_y);
            let chords = chords(angle_rad, radius_mm, tolerance_mm, MOST_CHORDS);
            let on_line = ladder.point([x, y]);
            let scale = radius_mm / x.hypot(y);
            for chord in 0..chords {
                let share = f64::from(chord) / f64::from(chords);
                let on_circle = ladder.point(turned([scale * x, scale * y], angle_rad * share));
                ladder.rungs.push(if is_outside { [on_line, on_circle] } else { [on_circle, on_line] });
            }
        }
        ladder.closed()
    }

    /// Fills the area within a line that is star-shaped about the origin.
    fn around_origin(line: &[[f64; 2]]) -> Self {
        let mut ladder = Self::default();
        let middle = ladder.point([0.0; 2]);
        for &point in line {
            let rung = [middle, ladder.point(point)];
            ladder.rungs.push(rung);
        }
        ladder.closed()
    }

    /// Fills a finger of the carrier: between its outer arc and its inner one, which runs the other way, or its point.
    fn finger(edges: &[Edge], tolerance_mm: f64) -> Self {
        let mut arcs = edges.iter().filter_map(|edge| match edge {
            Edge::Arc { radius_mm, sweep_deg, .. } => Some((edge.start(), *radius_mm, sweep_deg.to_radians())),
            Edge::Line { .. } | Edge::Curve { .. } => None,
        });
        let mut ladder = Self::default();
        let (Some((start, radius_mm, sweep_rad)), inner) = (arcs.next(), arcs.next()) else { return ladder };
        let chords = chords(sweep_rad, radius_mm, tolerance_mm, MOST_CHORDS);
        if inner.is_none() {
            ladder.point(edges[0].start());
        }
        for chord in 0..=chords {
            let share = f64::from(chord) / f64::from(chords);
            let on_inner =
                inner.map_or(0, |(start, _, sweep_rad)| ladder.point(turned(start, sweep_rad * (1.0 - share))));
            let rung = [on_inner, ladder.point(turned(start, sweep_rad * share))];
            ladder.rungs.push(rung);
        }
        ladder
    }

    fn point(&mut self, point: [f64; 2]) -> usize {
        self.points.push(point);
        self.points.len() - 1
    }

    /// Repeats the first rung as the last one.
    fn closed(mut self) -> Self {
        self.rungs.extend(self.rungs.first().copied());
        self
    }
}

/// Returns the points of a closed outline, each once.
fn line(outline: &Outline, tolerance_mm: f64) -> Vec<[f64; 2]> {
    let arc = |[x, y]: [f64; 2], [center_x, center_y]: [f64; 2], radius_mm: f64, sweep_rad: f64| {
        let chords = chords(sweep_rad, radius_mm, tolerance_mm, MOST_CHORDS);
        (0..chords).map(move |chord| {
            let share = f64::from(chord) / f64::from(chords);
            let [x, y] = turned([x - center_x, y - center_y], sweep_rad * share);
            [center_x + x, center_y + y]
        })
    };
    let points: Vec<_> = match outline {
        Outline::Circle { radius_mm } => arc([*radius_mm, 0.0], [0.0; 2], *radius_mm, 2.0 * PI).collect(),
        Outline::Path { edges } => edges
            .iter()
            .flat_map(|edge| match edge {
                Edge::Arc { center_mm, radius_mm, sweep_deg, .. } => {
                    arc(edge.start(), *center_mm, *radius_mm, sweep_deg.to_radians()).collect::<Vec<_>>()
                }
                Edge::Line { .. } | Edge::Curve { .. } => edge.points().take(edge.points().len() - 1).collect(),
            })
            .collect(),
    };
    let least_mm = LEAST_SHARE * points.iter().map(|[x, y]| x.hypot(*y)).fold(0.0, f64::max);
    let mut apart: Vec<[f64; 2]> = Vec::new();
    for [x, y] in points {
        if apart.first().into_iter().chain(apart.last()).all(|other| (x - other[0]).hypot(y - other[1]) > least_mm) {
            apart.push([x, y]);
        }
    }
    apart
}

/// Returns a point rotated about the origin.
fn turned([x, y]: [f64; 2], by_rad: f64) -> [f64; 2] {
    let (sin, cos) = by_rad.sin_cos();
    [x * cos - y * sin, x * sin + y * cos]
}

/// Returns the number of chords of an arc. Over the angle `4 asin √(t/2R)` a chord is t away from it, and no chord is
/// longer than the radius.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from one to the most")]
fn chords(angle_rad: f64, radius_mm: f64, tolerance_mm: f64, most: u32) -> u32 {
    let of_tolerance_rad = 4.0 * (0.5 * tolerance_mm / radius_mm).min(1.0).sqrt().asin();
    let chord_rad = of_tolerance_rad.min(PI / 3.0);
    (angle_rad.abs() / chord_rad).ceil().clamp(1.0, f64::from(most)) as u32
}
