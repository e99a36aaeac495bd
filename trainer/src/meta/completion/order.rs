//! In which order samples are taken, where a scan may end before the last one.

/// How many samples have an order; who takes more than these takes nearly all of them.
const ORDERED: usize = 16;

/// An order of samples, by index: each next one leaves the least loss together with those before it.
/// `loss` is told which samples there are.
pub fn greedy_order(samples: usize, mut loss: impl FnMut(&[bool]) -> f32) -> Vec<usize> {
    let mut present = vec![false; samples];
    let mut order = Vec::with_capacity(samples);
    let mut left: Vec<usize> = (0..samples).collect();
    for _ in 0..samples.min(ORDERED) {
        let with = left.iter().enumerate().map(|(place, sample)| {
            present[*sample] = true;
            let loss = loss(&present);
            present[*sample] = false;
            (place, loss)
        });
        let Some((place, _)) = with.min_by(|(_, a), (_, b)| a.total_cmp(b)) else {
            break;
        };
        let sample = left.remove(place);
        present[sample] = true;
        order.push(sample);
    }
    order.extend(left);
    order
}

/// Puts the entries of samples, `width` of each, into an order.
pub fn reorder(list: &mut [f32], width: usize, order: &[usize]) {
    let before = list.to_vec();
    let entries = order.iter().zip(list.chunks_exact_mut(width));
    for (sample, entry) in entries {
        entry.copy_from_slice(&before[sample * width..][..width]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sample 2 tells most; 0 tells nothing that 2 does not tell, 1 a little.
    fn told(present: &[bool]) -> f32 {
        let [first, second, third] = [0, 1, 2].map(|sample| f32::from(u8::from(present[sample])));
        1.0 - (0.6 * third).max(0.5 * first) - 0.3 * second
    }

    #[test]
    fn each_next_sample_tells_most_besides_those_before_it() {
        assert_eq!(greedy_order(3, told), [2, 1, 0]);
    }

    #[test]
    fn beyond_the_first_ones_samples_stay_as_they_are() {
        let samples = ORDERED + 3;
        let order = greedy_order(samples, |present| {
            let of_each = present.iter().enumerate();
            of_each
                .map(|(at, there)| if *there { at as f32 } else { 0.0 })
                .sum()
        });
        assert!(order.iter().copied().eq(0..samples));
        let backwards = greedy_order(samples, |present| {
            let of_each = present.iter().enumerate();
            of_each
                .map(|(at, there)| if *there { -(at as f32) } else { 0.0 })
                .sum()
        });
        assert!(backwards[..ORDERED].iter().copied().eq((3..samples).rev()));
        assert_eq!(backwards[ORDERED..], [0, 1, 2]);
    }

    #[test]
    fn entries_follow_their_samples_and_the_rest_stays() {
        let mut list = [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 9.0];
        reorder(&mut list, 2, &[2, 0, 1]);
        assert_eq!(list, [2.0, 2.5, 0.0, 0.5, 1.0, 1.5, 9.0]);
    }
}
