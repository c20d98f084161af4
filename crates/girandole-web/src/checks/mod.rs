//! What must be so in a browser.

mod driver;

use crate::serve::Site;
use crate::test::Check;

/// All of them, in the order in which they run.
pub const CHECKS: &[Check] = driver::CHECKS;

/// The site with the pages that checks bring along.
pub fn pages(site: Site) -> Site {
    driver::pages(site)
}
