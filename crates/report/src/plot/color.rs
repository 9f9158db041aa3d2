//! Colors that can be distinguished with any type of color vision, in print and on screens.

use std::fmt;

/// Red, green and blue, each from 0 to 255.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Color(pub u8, pub u8, pub u8);

impl Color {
    pub const BLACK: Self = Self(0, 0, 0);
    pub(crate) const WHITE: Self = Self(255, 255, 255);
    /// Color of background elements, such as mesh edges and reference lines.
    pub(crate) const GRAY: Self = Self(140, 140, 140);
    /// Color of grid lines.
    pub const PALE: Self = Self(228, 228, 228);
    /// Okabe–Ito blue.
    pub const BLUE: Self = Self(0, 114, 178);
    /// Okabe–Ito vermilion.
    pub const VERMILION: Self = Self(213, 94, 0);
    /// Okabe–Ito bluish green.
    pub const GREEN: Self = Self(0, 158, 115);
    /// Okabe–Ito reddish purple.
    pub(crate) const PURPLE: Self = Self(204, 121, 167);
    /// Okabe–Ito orange.
    pub const ORANGE: Self = Self(230, 159, 0);
    /// Okabe–Ito sky blue.
    pub const SKY: Self = Self(86, 180, 233);

    /// Number of different colors for series.
    pub(crate) const N_SERIES: usize = Self::ORDER.len();

    const ORDER: [Self; 7] = [
        Self::BLUE,
        Self::VERMILION,
        Self::GREEN,
        Self::PURPLE,
        Self::ORANGE,
        Self::SKY,
        Self::BLACK,
    ];

    /// Returns the color of the `i`-th series. The colors are from the palette of M. Okabe and K. Ito (2008)
    /// without yellow; they repeat if there are more series.
    pub(crate) fn of_series(i: usize) -> Self {
        Self::ORDER[i % Self::N_SERIES]
    }

    /// Returns a pale color for the `i`-th material. The mesh remains visible on this color.
    pub(crate) fn of_material(i: usize) -> Self {
        Self::of_series(i).paler()
    }

    /// Returns a color between dark blue (0) and yellow (1). The lightness increases monotonically, so that the order
    /// is visible in grayscale.
    pub(crate) fn of_fraction(fraction: f64) -> Self {
        // Equidistant samples of matplotlib's viridis map (public domain).
        const ANCHORS: [[f64; 3]; 9] = [
            [68.0, 1.0, 84.0],
            [71.0, 44.0, 122.0],
            [59.0, 81.0, 139.0],
            [44.0, 113.0, 142.0],
            [33.0, 144.0, 141.0],
            [39.0, 173.0, 129.0],
            [92.0, 200.0, 99.0],
            [170.0, 220.0, 50.0],
            [253.0, 231.0, 37.0],
        ];
        let place = fraction.clamp(0.0, 1.0) * (ANCHORS.len() - 1) as f64;
        let left = (place as usize).min(ANCHORS.len() - 2);
        let weight = place - left as f64;
        let channel = |c: usize| {
            ((1.0 - weight) * ANCHORS[left][c] + weight * ANCHORS[left + 1][c]).round() as u8
        };
        Self(channel(0), channel(1), channel(2))
    }

    /// Returns a pale color of the same hue. Lines remain visible on this color.
    pub(crate) fn paler(self) -> Self {
        let paler = |channel: u8| 255 - (255 - channel) / 4;
        Self(paler(self.0), paler(self.1), paler(self.2))
    }

    /// Scales the brightness; a factor of 1 returns the same color, and 0 returns black.
    #[must_use]
    pub(crate) fn darker(self, light: f64) -> Self {
        let Self(red, green, blue) = self;
        let channel = |c: u8| (light.clamp(0.0, 1.0) * f64::from(c)).round() as u8;
        Self(channel(red), channel(green), channel(blue))
    }

    /// Returns black or white, whichever contrasts better with this color.
    pub(crate) fn text_on(self) -> Self {
        if self.luminance() > 0.5 { Self::BLACK } else { Self::WHITE }
    }

    /// Returns the perceived brightness between 0 and 1 (weights of ITU-R BT.601).
    fn luminance(self) -> f64 {
        let Self(red, green, blue) = self;
        (0.299 * f64::from(red) + 0.587 * f64::from(green) + 0.114 * f64::from(blue)) / 255.0
    }
}

impl fmt::Display for Color {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "#{:02x}{:02x}{:02x}", self.0, self.1, self.2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fractions_grow_in_lightness() {
        let lightness: Vec<f64> =
            (0..=50).map(|i| Color::of_fraction(f64::from(i) / 50.0).luminance()).collect();
        assert!(lightness.windows(2).all(|pair| pair[0] < pair[1]), "{lightness:?}");
    }

    #[test]
    fn text_on_a_color_is_readable() {
        assert_eq!(Color(240, 228, 66).text_on(), Color::BLACK);
        assert_eq!(Color::BLUE.text_on(), Color::WHITE);
    }
}
