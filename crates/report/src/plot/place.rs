//! Positions on a page, in points (1/72 inch).

/// Point on the page, relative to the upper left corner.
pub type Point = [f64; 2];

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rect {
    /// Left edge.
    pub x: f64,
    /// Upper edge.
    pub y: f64,
    pub width: f64,
    pub height: f64,
}

impl Rect {
    pub fn right(&self) -> f64 {
        self.x + self.width
    }

    /// Returns whether the point lies in the rectangle; false if a coordinate is NaN.
    pub fn contains(&self, [x, y]: Point) -> bool {
        (self.x..=self.right()).contains(&x) && (self.y..=self.bottom()).contains(&y)
    }

    pub fn bottom(&self) -> f64 {
        self.y + self.height
    }
}
