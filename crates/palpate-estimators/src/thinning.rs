//! Even subsets of items, out of step with a periodic order.

/// One rising index from every `len`/`most` items, as recordings return to positions in turn.
///
/// # Panics
/// For `most` = 0.
pub(crate) fn thinned(len: usize, most: usize) -> impl ExactSizeIterator<Item = usize> + Clone {
    /// Golden ratio less 1: its multiples never come near a period.
    const IRRATIONAL: f64 = 0.618_033_988_749_895;
    assert!(most > 0, "at least one is kept");
    let kept = len.min(most);
    let first_of = move |i: usize| (i * len).div_ceil(kept);
    (0..kept).map(move |i| {
        let (from, to) = (first_of(i), first_of(i + 1));
        from + ((i as f64 * IRRATIONAL).fract() * (to - from) as f64) as usize
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn few_of_many_leave_no_part_of_a_period_out() {
        for period in [2, 3, 8, 16, 20, 40] {
            for (len, most) in [(800, 400), (960, 480), (4000, 500), (1600, 320), (20_000, 400)] {
                let parts: HashSet<usize> = thinned(len, most).map(|i| i % period).collect();
                assert_eq!(parts.len(), period, "{most} of {len}, which come back after {period}");
            }
        }
    }

    #[test]
    fn the_choice_is_even_and_rising() {
        for (len, most) in [(0, 5), (1, 1), (7, 7), (7, 100), (800, 399), (1001, 1000), (12_345, 500)] {
            let kept: Vec<usize> = thinned(len, most).collect();
            assert_eq!(kept.len(), len.min(most));
            assert!(kept.windows(2).all(|pair| pair[0] < pair[1]) && kept.iter().all(|i| *i < len));
            let widest = 2.0 * (len as f64 / most as f64).max(1.0);
            assert!(kept.windows(2).all(|pair| (pair[1] - pair[0]) as f64 <= widest), "{most} of {len}");
        }
    }
}
