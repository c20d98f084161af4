//! Mesa's software driver ends an invocation in silence after 65 535 steps of its loops, in all.

use crate::error::Remedy;
use crate::shader_constants::BATCH;
use crate::tier::Tier;
use crate::{Error, Result};

/// Those that invocations may take, with room for other loops.
const MOST: u32 = 60_000;
/// Items that an invocation takes from a work queue at most: lights behind joints take several steps each.
const MOST_ITEMS: u32 = 8;

/// Steps of an invocation for two points and so many lights with a filter of so many texels: one for each texel and row, and one for each
/// closer look at a texel.
fn of_chunk(lights: u32, filter: u32) -> u32 {
    let across = filter + 1;
    2 * lights.min(BATCH) * (2 * across * across + across)
}

/// Items that an invocation takes from a work queue.
pub(crate) fn queue_items(filter: u32) -> u32 {
    (MOST / of_chunk(BATCH, filter)).clamp(1, MOST_ITEMS)
}

/// Refuses a filter that is too wide for so many lights on such a device.
///
/// # Errors
/// [`Error::TooLarge`].
pub(crate) fn check(tier: Tier, filter: u32, lights: u32) -> Result<()> {
    if tier == Tier::Gpu || of_chunk(lights, filter) <= MOST {
        return Ok(());
    }
    let to = (0..filter).rev().find(|&filter| of_chunk(lights, filter) <= MOST).unwrap_or_default();
    let what = format!("on the software driver, a filter of {filter} texels is too wide for {lights} lights");
    Err(Error::too_large(what, Remedy::NarrowerFilter { to }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invocations_stay_below_what_the_driver_allows() {
        for filter in 0..=16 {
            for lights in [1, 50, 300, 512, 9999] {
                let is_allowed = check(Tier::Software, filter, lights).is_ok();
                assert!(!is_allowed || of_chunk(lights, filter) <= MOST);
                assert!(is_allowed || (filter > 4 && lights > 49), "{filter} {lights}");
                assert!(check(Tier::Gpu, filter, lights).is_ok());
                if let Err(Error::TooLarge { remedy: Remedy::NarrowerFilter { to }, .. }) =
                    check(Tier::Software, filter, lights)
                {
                    assert!(check(Tier::Software, to, lights).is_ok());
                    assert!(check(Tier::Software, to + 1, lights).is_err());
                }
            }
            assert!(queue_items(filter) == 1 || queue_items(filter) * of_chunk(BATCH, filter) <= MOST);
        }
        assert_eq!([0, 1, 2, 4].map(queue_items), [8, 5, 2, 1]);
    }
}
