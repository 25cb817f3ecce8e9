//! Plots with two logarithmic axes.

use std::error::Error;
use std::fs;
use std::path::Path;

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
            let line = LinePlot::new().with_data(series.points.clone()).with_color(color);
            if series.marked {
                drawn.push(Drawn::Line(line.with_stroke_width(1.5)));
                let points = ScatterPlot::new().with_data(series.points).with_color(color).with_size(4.0);
                drawn.push(Drawn::Scatter(points.with_legend(series.name)));
            } else {
                drawn.push(Drawn::Line(line.with_stroke_width(1.0).with_dashed().with_legend(series.name)));
            }
        }
        let layout = Layout::auto_from_plots(&drawn)
            .with_log_scale()
            .with_title(self.title)
            .with_x_label(self.x_label)
            .with_y_label(self.y_label)
            .with_x_tick_format(TickFormat::Sci)
            .with_y_tick_format(TickFormat::Sci)
            .with_width(760.0)
            .with_height(440.0);
        fs::write(path, SvgBackend.render_scene(&render_multiple(drawn, layout)))?;
        Ok(())
    }
}
