//! The order of samples, for scans that may end before the last one.

/// The number of samples that are sorted. The order of later readings hardly affects the loss.
const MAX_SORTED: usize = 16;
/// The number of candidates for each position. The cost is proportional to `MAX_SORTED` times `CANDIDATES`.
const CANDIDATES: usize = 64;

/// Returns a greedy order of samples, as indices. Each position has the candidate that minimizes the loss of the
/// samples up to that position. `loss` receives true for each present sample.
pub(super) fn greedy_order(samples: usize, mut loss: impl FnMut(&[bool]) -> f32) -> Vec<usize> {
    let mut present = vec![false; samples];
    let mut order = Vec::with_capacity(samples);
    let mut remaining: Vec<usize> = (0..samples).collect();
    while order.len() < MAX_SORTED && !remaining.is_empty() {
        let (mut best_position, mut min_loss) = (0, f32::INFINITY);
        for (position, sample) in remaining.iter().enumerate().take(CANDIDATES) {
            present[*sample] = true;
            let loss = loss(&present);
            present[*sample] = false;
            // Always false for NaN.
            if loss < min_loss {
                (best_position, min_loss) = (position, loss);
            }
        }
        let sample = remaining.remove(best_position);
        present[sample] = true;
        order.push(sample);
    }
    order.extend(remaining);
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn greedy_order_minimizes_loss_step_by_step() {
        // Sample 2 reduces the loss most. After it, sample 1 reduces the loss by 0.3, and sample 0 does not reduce it.
        let loss = |present: &[bool]| {
            let [first, second, third] =
                [0, 1, 2].map(|sample| f32::from(u8::from(present[sample])));
            1.0 - (0.6 * third).max(0.5 * first) - 0.3 * second
        };
        assert_eq!(greedy_order(3, loss), [2, 1, 0]);
        assert_eq!(greedy_order(0, loss), [0; 0]);
    }

    #[test]
    fn samples_with_nan_loss_come_last() {
        for nan in [f32::NAN, -f32::NAN] {
            let loss = |present: &[bool]| if present[0] { nan } else { 1.0 };
            assert_eq!(greedy_order(3, loss), [1, 2, 0]);
        }
    }

    #[test]
    fn only_first_samples_are_sorted() {
        let samples = CANDIDATES + 3;
        let loss = |present: &[bool]| {
            let samples = present.iter().enumerate().filter(|(_, present)| **present);
            -samples.map(|(sample, _)| sample as f32).sum::<f32>()
        };
        let order = greedy_order(samples, loss);
        // The last candidate has the smallest loss. Its removal makes the next sample a candidate.
        let (first, rest) = order.split_at(MAX_SORTED);
        assert_eq!(first[..4], [63, 64, 65, 66]);
        assert!(rest.is_sorted() && rest.len() == samples - MAX_SORTED);
    }
}
