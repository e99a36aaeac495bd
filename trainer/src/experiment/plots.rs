//! Plots that several experiments use.

use glimpse_trainer::report::{Axis, Marker, Plot, Scale, Series, SeriesColor};

use super::case::Approach;

/// Creates the series of a method, with the method's color and marker.
pub(super) fn series(approach: Approach, points: Vec<[f64; 2]>) -> Series {
    let (color, marker) = match approach {
        Approach::Random => (SeriesColor::Vermillion, Marker::Cross),
        Approach::Meta(_) => (SeriesColor::Orange, Marker::Triangle),
        Approach::Njr15 => (SeriesColor::Green, Marker::Ring),
        Approach::Ours(_) => (SeriesColor::Blue, Marker::Disc),
        Approach::Optimum => (SeriesColor::Purple, Marker::LargeDisc),
    };
    Series {
        name: approach.title(),
        color,
        marker,
        points,
    }
}

/// Creates a logarithmic axis for a metric whose lower values are better.
pub(super) fn metric_axis(metric: &str) -> Axis {
    Axis {
        title: format!("{metric} (lower is better)"),
        scale: Scale::Log10,
    }
}

/// Creates a plot of a metric over the number of samples n.
pub(super) fn plot_over_samples(title: String, metric: &str, series: Vec<Series>) -> Plot {
    Plot {
        title,
        x: Axis {
            title: "samples n".into(),
            scale: Scale::Log2,
        },
        y: metric_axis(metric),
        series,
    }
}
