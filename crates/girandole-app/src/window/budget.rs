//! A budget for frames while things move: fewer pixels and fewer shadow maps, as many as the time allows.

use girandole::{MapUpdates, RenderSettings};

/// Share of the budget that frames are to take: what is left is for frames that take longer than the last ones.
const AIM: f64 = 0.75;
/// How fast quality falls where frames take longer than that, and rises where they take less; a frame.
const FALL: f64 = 0.5;
const RISE: f64 = 0.06;
/// The picture has this share of the pixels along each axis at least: a quarter of them all.
const LEAST_SCALE: f64 = 0.5;
/// Sizes between that and the whole; another size has other textures.
const SIZES: f64 = 4.0;
/// Of the maps that a frame may draw, so many are drawn at least.
const LEAST_MAPS: f64 = 10.0;
/// Maps of a frame where all may be drawn.
const MANY_MAPS: f64 = 300.0;

/// How much of its quality a picture has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quality {
    /// Of the pixels along each axis.
    scale: f64,
    /// Shadow maps that are drawn, at most.
    maps: Option<u32>,
}

impl Quality {
    /// All that was asked for.
    pub const FULL: Self = Self { scale: 1.0, maps: None };

    /// Of a first picture.
    pub const PRELIMINARY: Self = Self { scale: LEAST_SCALE, maps: None };

    /// Pixels of a picture, of as many that were asked for.
    pub fn size(&self, size: [u32; 2]) -> [u32; 2] {
        size.map(|pixels| ((f64::from(pixels) * self.scale).ceil() as u32).max(1))
    }

    /// What a frame does, where so much was asked for.
    pub fn settings(&self, settings: &RenderSettings) -> RenderSettings {
        let most = match (self.maps, settings.updates.most) {
            (Some(a), Some(b)) => Some(a.min(b)),
            (maps, asked) => maps.or(asked),
        };
        RenderSettings { updates: MapUpdates { most, ..settings.updates }, ..*settings }
    }
}

/// What a frame may take while things move, and what that is enough for.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    /// Milliseconds; `None` = any.
    pub milliseconds: Option<f64>,
    /// Between the least quality and the full one.
    level: f64,
}

impl Budget {
    pub fn new(milliseconds: Option<f64>) -> Self {
        Self { milliseconds, level: 0.0 }
    }

    /// The quality of the next frame while things move.
    pub fn quality(&self) -> Quality {
        if self.milliseconds.is_none() || self.level >= 1.0 {
            return Quality::FULL;
        }
        let step = (self.level * SIZES).floor() / SIZES;
        let maps = LEAST_MAPS + self.level * (MANY_MAPS - LEAST_MAPS);
        Quality { scale: LEAST_SCALE + step * (1.0 - LEAST_SCALE), maps: Some(maps as u32) }
    }

    /// A frame while things moved took so many milliseconds.
    pub fn took(&mut self, milliseconds: f64) {
        let Some(budget) = self.milliseconds else { return };
        let over = milliseconds / (AIM * budget) - 1.0;
        let by = if over > 0.0 { FALL * over } else { RISE * over };
        self.level = (self.level - by).clamp(0.0, 1.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A device on which a frame takes `fixed` ms and so many for all pixels and for all maps.
    fn frame(quality: Quality, [fixed, pixels, maps]: [f64; 3]) -> f64 {
        let [width, height] = quality.size([1000, 1000]).map(f64::from);
        let drawn = quality.maps.map_or(300.0, |maps| f64::from(maps.min(300)));
        fixed + pixels * width * height * 1e-6 + maps * drawn / 300.0
    }

    #[test]
    fn nineteen_of_twenty_frames_keep_the_budget() {
        for costs in [[5.0, 20.0, 10.0], [10.0, 150.0, 100.0], [20.0, 250.0, 10.0], [5.0, 60.0, 400.0]] {
            let mut budget = Budget::new(Some(100.0));
            let mut kept = 0;
            for i in 0..400 {
                // Every third frame takes a tenth longer.
                let took = frame(budget.quality(), costs) * if i % 3 == 0 { 1.1 } else { 1.0 };
                kept += u32::from(took <= 100.0);
                budget.took(took);
                let [width, height] = budget.quality().size([1000, 1000]);
                assert!(width * height >= 250_000);
            }
            assert!(kept >= 380, "{costs:?}: {kept} of 400");
        }
    }

    #[test]
    fn fast_devices_get_full_quality_and_slow_ones_the_least() {
        let after = |costs| {
            let mut budget = Budget::new(Some(100.0));
            (0..200).for_each(|_| budget.took(frame(budget.quality(), costs)));
            budget.quality()
        };
        assert_eq!(after([1.0, 5.0, 5.0]), Quality::FULL);
        assert_eq!(after([50.0, 500.0, 500.0]), Budget::new(Some(100.0)).quality());
        assert_eq!(Budget::new(None).quality(), Quality::FULL);
    }

    #[test]
    fn fewer_maps_than_asked_for_but_never_more() {
        let settings = |most| RenderSettings {
            updates: MapUpdates { most, ..MapUpdates::default() },
            ..RenderSettings::default()
        };
        let least = Budget::new(Some(100.0)).quality();
        let most = |asked| least.settings(&settings(asked)).updates.most;
        assert_eq!((most(None), most(Some(4)), most(Some(100))), (Some(10), Some(4), Some(10)));
        assert_eq!(Quality::FULL.settings(&settings(Some(7))), settings(Some(7)));
    }
}
