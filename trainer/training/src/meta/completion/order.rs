//! In which order samples are taken, where a scan may end before the last one.

/// How many samples come in order, and among how many they are looked for: what it takes grows with the
/// product, and by the sixteenth reading the next one hardly matters.
const ORDERED: usize = 16;
const CANDIDATES: usize = 64;

/// An order of samples, by index: each next one leaves the least loss together with those before it.
/// `loss` is told which samples there are.
pub(super) fn greedy_order(samples: usize, mut loss: impl FnMut(&[bool]) -> f32) -> Vec<usize> {
    let mut present = vec![false; samples];
    let mut order = Vec::with_capacity(samples);
    let mut left: Vec<usize> = (0..samples).collect();
    while order.len() < ORDERED && !left.is_empty() {
        let (mut best, mut least) = (0, f32::INFINITY);
        for (place, sample) in left.iter().enumerate().take(CANDIDATES) {
            present[*sample] = true;
            let loss = loss(&present);
            present[*sample] = false;
            // Never true of what is no number.
            if loss < least {
                (best, least) = (place, loss);
            }
        }
        let sample = left.remove(best);
        present[sample] = true;
        order.push(sample);
    }
    order.extend(left);
    order
}

/// Puts the entries of samples, `width` of each, into an order.
pub(super) fn reorder(list: &mut [f32], width: usize, order: &[usize]) {
    let before = list.to_vec();
    let entries = order.iter().zip(list.chunks_exact_mut(width));
    for (sample, entry) in entries {
        entry.copy_from_slice(&before[sample * width..][..width]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_next_sample_tells_most_besides_those_before_it() {
        // Sample 2 tells most; 0 tells nothing that 2 does not tell, 1 a little.
        let told = |present: &[bool]| {
            let [first, second, third] =
                [0, 1, 2].map(|sample| f32::from(u8::from(present[sample])));
            1.0 - (0.6 * third).max(0.5 * first) - 0.3 * second
        };
        assert_eq!(greedy_order(3, told), [2, 1, 0]);
        assert_eq!(greedy_order(0, told), [0; 0]);
    }

    #[test]
    fn what_is_no_number_is_taken_last() {
        for no_number in [f32::NAN, -f32::NAN] {
            let told = |present: &[bool]| if present[0] { no_number } else { 1.0 };
            assert_eq!(greedy_order(3, told), [1, 2, 0]);
        }
    }

    #[test]
    fn beyond_the_first_ones_samples_stay_as_they_are() {
        let samples = CANDIDATES + 3;
        let last_first = |present: &[bool]| {
            let there = present.iter().enumerate().filter(|(_, there)| **there);
            -there.map(|(at, _)| at as f32).sum::<f32>()
        };
        let order = greedy_order(samples, last_first);
        // Each time one more comes into sight.
        let (first, rest) = order.split_at(ORDERED);
        assert_eq!(first[..4], [63, 64, 65, 66]);
        assert!(rest.is_sorted() && rest.len() == samples - ORDERED);
    }

    #[test]
    fn entries_follow_their_samples_and_the_rest_stays() {
        let mut list = [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 9.0];
        reorder(&mut list, 2, &[2, 0, 1]);
        assert_eq!(list, [2.0, 2.5, 0.0, 0.5, 1.0, 1.5, 9.0]);
    }
}
