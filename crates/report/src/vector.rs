//! Vectors in 3D.

pub(crate) type Place = [f64; 3];

/// Returns x + factor y.
pub(crate) fn plus(x: Place, factor: f64, y: Place) -> Place {
    [0, 1, 2].map(|i| x[i] + factor * y[i])
}

pub(crate) fn minus(x: Place, y: Place) -> Place {
    [0, 1, 2].map(|i| x[i] - y[i])
}

pub(crate) fn dot(x: Place, y: Place) -> f64 {
    x[0] * y[0] + x[1] * y[1] + x[2] * y[2]
}

pub(crate) fn length(x: Place) -> f64 {
    dot(x, x).sqrt()
}

pub(crate) fn cross(x: Place, y: Place) -> Place {
    [0, 1, 2].map(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        x[j] * y[k] - x[k] * y[j]
    })
}

/// Returns the normal of a triangle; its length is twice the area. Seen from the tip of the normal, the corners are
/// counterclockwise.
pub(crate) fn normal([a, b, c]: [Place; 3]) -> Place {
    cross(minus(b, a), minus(c, a))
}
