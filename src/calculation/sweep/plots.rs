//! A sweep's plots as SVG: force and stress of each contact over the place where it acts, as in the paper's figures 11 to 16.

use std::io::{self, Write};
use std::ops::Range;

use kuva::backend::svg::SvgBackend;
use kuva::plot::{LinePlot, ScatterPlot};
use kuva::render::figure::Figure;
use kuva::render::layout::Layout;
use kuva::render::plots::Plot;

use super::answer::{StatesAnswer, SweepAnswer};
use toothwave_solver::sweep::Peak;

/// Apart for readers who do not tell red from green (Okabe and Ito): force, stress.
const COLORS: [&str; 2] = ["#0072b2", "#d55e00"];

/// More points than a line of a plot this wide can show.
const MOST_POINTS: usize = 4000;

/// And more pieces of one.
const MOST_PIECES: usize = 500;

/// Positions closer than this, in degrees, are one place.
const SAME_DEG: f64 = 1e-9;

/// Stretches of the pass, of each of which the largest load is drawn where items deviate.
const MOST_STRETCHES: f64 = 200.0;

/// One plot: what is drawn over what.
struct Panel<'a> {
    title: String,
    x_label: &'static str,
    y_label: String,
    color: &'static str,
    x: &'a [f64],
    y: &'a [f64],
    peak: &'a Peak,
}

/// A tooth's pass through the zone, from entry to root: all states by position, and pieces of the places where they stand, each a stretch of these states.
struct Pass {
    states: Vec<usize>,
    pieces: Vec<Vec<Range<usize>>>,
}

pub(super) fn write(sweep: &SweepAnswer, writer: &mut dyn Write) -> io::Result<()> {
    let states = &sweep.states;
    let pass = Pass::of(sweep);
    let (mut plots, mut layouts) = (Vec::new(), Vec::new());
    for panel in panels(sweep) {
        // Of a million states each takes tens of milliseconds: whoever wants it stopped is asked before.
        writer.flush()?;
        // The state with the largest load of those at a place.
        let point = |place: &Range<usize>| {
            let there = &pass.states[place.clone()];
            let most = |at, &i: &usize| if panel.y[i] > panel.y[at] { i } else { at };
            let at = there.iter().fold(there[0], most);
            (panel.x[at], panel.y[at])
        };
        let points = |piece: &Vec<Range<usize>>| piece.iter().map(point).collect::<Vec<_>>();
        let line = |points| LinePlot::new().with_data::<f64, f64, Vec<_>>(points).with_color(panel.color);
        let mut drawn: Vec<_> =
            pass.pieces.iter().map(|piece| Plot::Line(line(points(piece)).with_stroke_width(1.5))).collect();
        let at_peak = (0..panel.y.len()).min_by(|&one, &other| {
            let away = |i: usize| {
                (states.input_angle_deg[i] - panel.peak.input_angle_deg).abs()
                    + (states.position_deg[i] - panel.peak.position_deg).abs()
            };
            away(one).total_cmp(&away(other))
        });
        if let Some(i) = at_peak {
            let mark = ScatterPlot::new().with_data([(panel.x[i], panel.peak.value)]);
            drawn.push(Plot::Scatter(mark.with_color(panel.color).with_size(4.0)));
        }
        let layout = Layout::auto_from_plots(&drawn).with_title(panel.title);
        layouts.push(layout.with_x_label(panel.x_label).with_y_label(panel.y_label));
        plots.push(drawn);
    }
    let figure = Figure::new(2, 3).with_plots(plots).with_layouts(layouts).with_cell_size(420.0, 300.0);
    let mut text = own_ids(&SvgBackend.render_scene(&figure.render()));
    text.push('\n');
    writer.write_all(text.as_bytes())
}

/// Ids that kuva numbers through the whole process, numbered anew, so that a picture's bytes follow from its content.
fn own_ids(text: &str) -> String {
    const ID: &str = "kuva-clip-";
    let mut parts = text.split(ID);
    let mut numbered = parts.next().unwrap_or_default().to_owned();
    let mut seen: Vec<&str> = Vec::new();
    for part in parts {
        let (number, rest) = part.split_at(part.find(|letter: char| !letter.is_ascii_digit()).unwrap_or(part.len()));
        let own = seen.iter().position(|known| *known == number).unwrap_or_else(|| {
            seen.push(number);
            seen.len() - 1
        });
        numbered.push_str(&format!("{ID}{own}{rest}"));
    }
    numbered
}

fn panels(sweep: &SweepAnswer) -> Vec<Panel<'_>> {
    let SweepAnswer { states, peaks, .. } = sweep;
    let most = if sweep.sweep_period_deg.is_some() { "largest of all teeth, " } else { "" };
    let x = [
        ("wave generator", "φ_H from the valley, deg", &states.wave_generator_angle_deg),
        ("ring", "φ_K from the tooth tip, deg", &states.ring_angle_deg),
        ("carrier", "centre's distance from the axis, mm", &states.center_radius_mm),
    ];
    let forces = [&states.force_wave_generator_n, &states.force_ring_n, &states.force_carrier_n];
    let stresses = [&states.stress_wave_generator_mpa, &states.stress_ring_mpa, &states.stress_carrier_mpa];
    let peaks = [&peaks.wave_generator, &peaks.ring, &peaks.carrier];
    let quantities = [
        ("Force", format!("force, {most}N"), "N", COLORS[0], forces, peaks.map(|peaks| &peaks.force_n)),
        ("Stress", format!("stress, {most}MPa"), "MPa", COLORS[1], stresses, peaks.map(|peaks| &peaks.stress_mpa)),
    ];
    let mut panels = Vec::new();
    for (quantity, y_label, unit, color, y, peaks) in quantities {
        for (((contact, x_label, x), y), peak) in x.into_iter().zip(y).zip(peaks) {
            let title = format!("{quantity}, {contact}: up to {:.1} {unit}", peak.value);
            panels.push(Panel { title, x_label, y_label: y_label.clone(), color, x, y, peak });
        }
    }
    panels
}

impl Pass {
    /// Put together from the teeth of one period as the paper does it (its figures 8 to 10). Where a tooth enters under load, the others' loads jump:
    /// there a piece ends. Where items deviate each tooth has a course of its own, and one piece runs over the largest of them all.
    fn of(sweep: &SweepAnswer) -> Self {
        let SweepAnswer { states, enters_under_load, sweep_period_deg, .. } = sweep;
        let items_deviate = sweep_period_deg.is_some();
        // States stand by input angle, then tooth; where an angle stands twice, the teeth start anew.
        let goes_on = |&before: &usize, &i: &usize| {
            states.tooth[i] > states.tooth[before] && states.input_angle_deg[i] <= states.input_angle_deg[before]
        };
        let indices: Vec<usize> = (0..states.tooth.len()).collect();
        let frames: Vec<_> = indices.chunk_by(goes_on).collect();
        let mut points: Vec<(usize, bool)> = Vec::new();
        // The last frame repeats the first; it only tells whether a tooth entered before it.
        for pair in frames.windows(2) {
            let jumps = *enters_under_load && !items_deviate && enters_loaded(states, pair[0], pair[1]);
            points.extend(pair[0].iter().map(|&i| (i, jumps)));
        }
        // Where an angle stands twice, what was before the jump comes first.
        points.sort_by(|&(one, one_jumps), &(other, other_jumps)| {
            states.position_deg[other].total_cmp(&states.position_deg[one]).then(other_jumps.cmp(&one_jumps))
        });
        let position_deg = |&(i, _): &(usize, bool)| states.position_deg[i];
        let stretch_deg = match (points.first(), points.last()) {
            (Some(first), Some(last)) if items_deviate => (position_deg(first) - position_deg(last)) / MOST_STRETCHES,
            _ => 0.0,
        };
        let mut places: Vec<(Range<usize>, bool)> = Vec::new();
        for (at, point) in points.iter().enumerate() {
            match places.last_mut() {
                Some((place, jumps))
                    if *jumps == point.1
                        && (position_deg(&points[at - 1]) - position_deg(point) <= SAME_DEG
                            || position_deg(&points[place.start]) - position_deg(point) < stretch_deg) =>
                {
                    place.end = at + 1;
                }
                _ => places.push((at..at + 1, point.1)),
            }
        }
        let stride = places.len().div_ceil(MOST_POINTS).max(1);
        let mut ending = 0;
        let between_ends = places.iter().filter(|(_, ends)| *ends).count().div_ceil(MOST_PIECES).max(1);
        let mut pieces = vec![Vec::new()];
        for (index, (place, ends)) in places.into_iter().enumerate() {
            let current = pieces.len() - 1;
            ending += usize::from(ends);
            let ends = ends && ending % between_ends == 0;
            if index % stride == 0 || ends {
                pieces[current].push(place);
            }
            if ends {
                pieces.push(Vec::new());
            }
        }
        pieces.retain(|piece| !piece.is_empty());
        Self { states: points.into_iter().map(|(i, _)| i).collect(), pieces }
    }
}

/// Whether a tooth that carries comes to a lobe from one frame to the next. Teeth ascend in either; where zones are unlike they have the numbers of their
/// slots, of which the one that enters need not be the largest.
fn enters_loaded(states: &StatesAnswer, frame: &[usize], next: &[usize]) -> bool {
    let lobe = |i: usize| states.lobe.as_ref().map_or(0, |lobe| lobe[i]);
    let is_loaded = |i: usize| states.loaded.as_ref().is_none_or(|loaded| loaded[i]);
    let mut before = frame.iter().peekable();
    next.iter().any(|&i| {
        while before.next_if(|&&j| states.tooth[j] < states.tooth[i]).is_some() {}
        let was_there = before.peek().is_some_and(|&&j| states.tooth[j] == states.tooth[i] && lobe(j) == lobe(i));
        !was_there && is_loaded(i)
    })
}
