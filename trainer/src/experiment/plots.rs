//! Plots of several experiments.

use glimpse_trainer::report::{Axis, Hue, Mark, Plot, Scale, Series};

use super::case::Approach;

/// The curve of a method, in its color and mark.
pub(super) fn series(approach: Approach, points: Vec<[f64; 2]>) -> Series {
    let (hue, mark) = match approach {
        Approach::Random => (Hue::Vermillion, Mark::Crosses),
        Approach::Meta(_) => (Hue::Orange, Mark::Triangles),
        Approach::Njr15 => (Hue::Green, Mark::Rings),
        Approach::Ours(_) => (Hue::Blue, Mark::Discs),
        Approach::Optimum => (Hue::Purple, Mark::Dots),
    };
    Series {
        name: approach.title(),
        hue,
        mark,
        points,
    }
}

/// An axis of a metric of which less is better.
pub(super) fn metric_axis(metric: &str) -> Axis {
    Axis {
        title: format!("{metric} (less is better)"),
        scale: Scale::Decades,
    }
}

/// A metric by the number of samples n.
pub(super) fn by_samples(title: String, metric: &str, series: Vec<Series>) -> Plot {
    Plot {
        title,
        x: Axis {
            title: "samples n".into(),
            scale: Scale::Doublings,
        },
        y: metric_axis(metric),
        series,
    }
}
