//! Plots with two logarithmic axes.
//!
//! kuva's own logarithmic axes end at 1e-10, and errors do not: it is given the logarithms, and labels that undo them.

use std::error::Error;
use std::fs;
use std::path::Path;
use std::sync::Arc;

use kuva::backend::svg::SvgBackend;
use kuva::plot::{LinePlot, ScatterPlot};
use kuva::render::layout::{Layout, TickFormat};
use kuva::render::plots::Plot as Drawn;
use kuva::render::render::render_multiple;

/// Apart for readers who do not tell red from green (Okabe and Ito).
const COLORS: [&str; 3] = ["#0072b2", "#d55e00", "#009e73"];

/// A plot.
#[derive(Debug)]
pub(crate) struct Plot<'a> {
    pub(crate) title: &'a str,
    pub(crate) x_label: &'a str,
    pub(crate) y_label: &'a str,
    /// Decades from one label of the vertical axis to the next.
    pub(crate) decades_per_tick: f64,
    pub(crate) series: Vec<Series<'a>>,
}

/// What is drawn in one colour.
#[derive(Debug)]
pub(crate) struct Series<'a> {
    name: &'a str,
    points: Vec<(f64, f64)>,
    marked: bool,
}

impl<'a> Series<'a> {
    /// Points joined in their order.
    pub(crate) fn points(name: &'a str, points: Vec<(f64, f64)>) -> Self {
        Self { name, points, marked: true }
    }

    /// A line without points.
    pub(crate) fn line(name: &'a str, points: Vec<(f64, f64)>) -> Self {
        Self { name, points, marked: false }
    }
}

impl Plot<'_> {
    /// Writes it as SVG.
    pub(crate) fn write(self, path: &Path) -> Result<(), Box<dyn Error>> {
        let mut drawn = Vec::new();
        for (series, color) in self.series.into_iter().zip(COLORS) {
            let logarithms = || series.points.iter().map(|(x, y)| (x.log10(), y.log10()));
            let line = LinePlot::new().with_data(logarithms()).with_color(color);
            if series.marked {
                drawn.push(Drawn::Line(line.with_stroke_width(1.5)));
                let points = ScatterPlot::new().with_data(logarithms()).with_color(color).with_size(4.0);
                drawn.push(Drawn::Scatter(points.with_legend(series.name)));
            } else {
                drawn.push(Drawn::Line(line.with_stroke_width(1.0).with_dashed().with_legend(series.name)));
            }
        }
        let power = || TickFormat::Custom(Arc::new(|exponent: f64| format!("1e{exponent:.0}")));
        let layout = Layout::auto_from_plots(&drawn)
            .with_title(self.title)
            .with_x_label(self.x_label)
            .with_y_label(self.y_label)
            .with_x_tick_step(1.0)
            .with_y_tick_step(self.decades_per_tick)
            .with_x_tick_format(power())
            .with_y_tick_format(power())
            .with_width(760.0)
            .with_height(440.0);
        fs::write(path, SvgBackend.render_scene(&render_multiple(drawn, layout)))?;
        Ok(())
    }
}
