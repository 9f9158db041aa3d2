//! Plots of meshes of quadratic triangles, with edges, named parts of the boundary, deformation and a field.

use super::arrow;
use super::axis::Axis;
use super::bands::band;
use super::bar::Bar;
use super::color::Color;
use super::figure::{Margins, Panel, TICK_SIZE};
use super::frame::Frame;
use super::legend::{self, Entry, Key};
use super::place::{Point, Rect};
use super::svg::{self, Stroke, Svg, Type};

/// Division of a triangle with six nodes (corners, then midside nodes) into four triangles, which follow curved edges.
pub(crate) const QUARTERS: [[usize; 3]; 4] = [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]];

/// Named edges, which form a part of the boundary or an interface between two materials.
#[derive(Debug, Clone)]
pub struct EdgeGroup {
    /// Name in the legend.
    pub name: String,
    /// Edges, each given by its two ends and its midside node.
    pub edges: Vec<[usize; 3]>,
    pub color: Color,
    /// Direction of the arrows that show a load on the edges.
    pub arrows: Option<Point>,
}

#[derive(Debug, Clone)]
pub struct Region {
    pub triangles: Vec<usize>,
    pub color: Color,
}

/// Values at the nodes, which are shown as color bands.
#[derive(Debug, Clone)]
pub struct Field {
    /// Label, unit and limits.
    pub axis: Axis,
    pub values: Vec<f64>,
}

/// Mesh of triangles with corner and midside nodes, drawn with equal scales on both axes.
#[derive(Debug, Clone, Default)]
pub struct MeshPlot {
    /// Title above the plot; may be empty.
    pub title: String,
    pub x: Axis,
    pub y: Axis,
    /// Undeformed positions of all nodes.
    pub nodes: Vec<Point>,
    /// Nodes of each triangle: the corners a, b, c, and the midside nodes of ab, bc and ca.
    pub triangles: Vec<[usize; 6]>,
    /// Displacement of each node; may be empty.
    pub displacement: Vec<Point>,
    /// Factor by which the displacement is multiplied. If there is a displacement, the factor is printed after the
    /// title.
    pub scale: f64,
    pub regions: Vec<Region>,
    pub groups: Vec<EdgeGroup>,
    pub obstacles: Vec<Vec<Point>>,
    /// Marked nodes with their labels.
    pub marks: Vec<(usize, String)>,
    pub field: Option<Field>,
}

const ARROW: f64 = 11.0;
const GROUP_WIDTH: f64 = 2.0;
const OBSTACLE: f64 = 1.0;
/// Style of the undeformed boundary.
const AT_REST: Stroke = Stroke { color: Color::BLACK, width: 0.6, dashes: &[3.0, 1.5] };

impl MeshPlot {
    fn positions(&self) -> Vec<Point> {
        if self.displacement.is_empty() {
            return self.nodes.clone();
        }
        let moved = |(node, u): (&Point, &Point)| {
            [node[0] + self.scale * u[0], node[1] + self.scale * u[1]]
        };
        self.nodes.iter().zip(&self.displacement).map(moved).collect()
    }

    /// Returns the title, followed by the scale of the deformation.
    fn header(&self) -> String {
        let scale = if self.displacement.is_empty() {
            String::new()
        } else {
            format!("displacement × {}", self.scale)
        };
        let parts = [self.title.as_str(), &scale];
        parts.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(", ")
    }

    /// Returns axes whose limits enclose the mesh.
    fn axes(&self) -> [Axis; 2] {
        let positions = self.positions();
        let enclose = |axis: &Axis, c: usize, air: f64| {
            let [low, high] = axis.limits.unwrap_or_else(|| {
                let values = || positions.iter().map(|point| point[c]);
                let low = values().fold(f64::INFINITY, f64::min);
                let high = values().fold(f64::NEG_INFINITY, f64::max);
                let margin = air * (high - low);
                [low - margin, high + margin]
            });
            axis.clone().between(low, high)
        };
        // Arrows of loads and obstacles need space around the mesh.
        let has_obstacles = !self.obstacles.is_empty();
        let air = if has_obstacles || self.groups.iter().any(|group| group.arrows.is_some()) {
            0.3
        } else {
            0.08
        };
        [enclose(&self.x, 0, 0.04), enclose(&self.y, 1, air)]
    }

    fn entries(&self) -> Vec<Entry<'_>> {
        let key = |group: &EdgeGroup| Key::Line(Stroke::solid(group.color, GROUP_WIDTH));
        let groups = self.groups.iter().map(|group| Entry { name: &group.name, key: key(group) });
        let at_rest = (!self.displacement.is_empty())
            .then_some(Entry { name: "at rest", key: Key::Line(AT_REST) });
        let obstacles = (!self.obstacles.is_empty()).then_some(Entry {
            name: "obstacle",
            key: Key::Line(Stroke::solid(Color::BLACK, OBSTACLE)),
        });
        groups.chain(at_rest).chain(obstacles).collect()
    }

    fn bar(&self) -> Option<Bar<'_>> {
        let field = self.field.as_ref()?;
        Some(Bar::new(&field.axis, &field.values))
    }
}

impl Panel for MeshPlot {
    fn margins(&self, width: f64, height: f64) -> Margins {
        let [x, y] = self.axes();
        let margins =
            Frame::new((&x, [].into_iter()), (&y, [].into_iter()), (width, height)).margins();
        let header = legend::height(&self.header(), &self.entries(), width);
        let bar = self.bar().map_or(0.0, |bar| bar.margin());
        Margins { top: margins.top.max(header), right: margins.right.max(bar), ..margins }
    }

    fn aspect(&self) -> Option<f64> {
        let [x, y] = self.axes();
        let extent = |axis: Axis| axis.limits.map_or(1.0, |[low, high]| high - low);
        Some(extent(y) / extent(x))
    }

    fn draw(&self, svg: &mut Svg, area: Rect) {
        let [x, y] = self.axes();
        let frame =
            Frame::new((&x, [].into_iter()), (&y, [].into_iter()), (area.width, area.height));
        let place = |points: Vec<Point>| -> Vec<Point> {
            let points = points.into_iter();
            points.map(|point| frame.place(area, point)).collect()
        };
        let placed = place(self.positions());
        svg.clipped(area, |svg| {
            for region in &self.regions {
                self.draw_region(svg, &placed, region);
            }
            if let (Some(field), Some(bar)) = (&self.field, self.bar()) {
                self.draw_field(svg, &placed, field, &bar);
            }
            self.draw_edges(svg, &placed);
            if !self.displacement.is_empty() {
                self.draw_at_rest(svg, &place(self.nodes.clone()));
            }
            for group in &self.groups {
                draw_group(svg, &placed, group);
            }
            for outline in &self.obstacles {
                let path = svg::path(&place(outline.clone()));
                svg.path(&path, Stroke::solid(Color::BLACK, OBSTACLE));
            }
            for (node, label) in &self.marks {
                svg.disc(placed[*node], 1.9, Color::BLACK);
                let at = [placed[*node][0] + 3.0, placed[*node][1] - 3.0];
                svg.text(at, label, Type::of(TICK_SIZE).haloed());
            }
        });
        frame.draw(svg, area);
        if let Some(bar) = self.bar() {
            bar.draw(svg, area);
        }
        legend::draw(svg, area, &self.header(), &self.entries());
    }
}

impl MeshPlot {
    fn draw_edges(&self, svg: &mut Svg, placed: &[Point]) {
        let mut edges = sides(&self.triangles);
        edges.dedup();
        let path: String = edges.iter().map(|edge| curve(placed, edge)).collect();
        svg.path(&path, Stroke::solid(Color::GRAY, 0.3));
    }

    /// Draws the boundary of the undeformed mesh.
    fn draw_at_rest(&self, svg: &mut Svg, placed: &[Point]) {
        let boundary = boundary(&self.triangles);
        let path: String = boundary.iter().map(|edge| curve(placed, edge)).collect();
        svg.path(&path, AT_REST);
    }

    fn draw_region(&self, svg: &mut Svg, placed: &[Point], region: &Region) {
        let triangles = region.triangles.iter().map(|&t| &self.triangles[t]);
        let corners = triangles.map(|t| [placed[t[0]], placed[t[1]], placed[t[2]]]);
        let path: String = corners.map(|corners| svg::path(&corners) + "Z").collect();
        svg.fill(&path, region.color);
    }

    fn draw_field(&self, svg: &mut Svg, placed: &[Point], field: &Field, bar: &Bar<'_>) {
        let levels = &bar.levels;
        // Values beyond the given limits have the color of the limit.
        let (low, high) = (levels[0], levels[levels.len() - 1]);
        let valued = |i: usize| (placed[i], field.values[i].clamp(low, high));
        for (k, level) in levels.windows(2).enumerate() {
            let mut path = String::new();
            for t in &self.triangles {
                for [a, b, c] in QUARTERS {
                    let triangle = [valued(t[a]), valued(t[b]), valued(t[c])];
                    let polygon = band(&triangle, level[0], level[1]);
                    if polygon.len() > 2 {
                        path += &svg::path(&polygon);
                        path.push('Z');
                    }
                }
            }
            svg.fill(&path, bar.color(k));
        }
    }
}

/// Returns the edges that belong to exactly one triangle. Each edge is given by its two ends and its midside node.
pub fn boundary(triangles: &[[usize; 6]]) -> Vec<[usize; 3]> {
    let sides = sides(triangles);
    let alone = sides.chunk_by(|a, b| a == b).filter(|side| side.len() == 1);
    alone.map(|side| side[0]).collect()
}

/// Returns the sides of all triangles, sorted. Interior sides occur twice.
fn sides(triangles: &[[usize; 6]]) -> Vec<[usize; 3]> {
    let sides = |t: &[usize; 6]| [[t[0], t[1], t[3]], [t[1], t[2], t[4]], [t[2], t[0], t[5]]];
    let mut edges: Vec<[usize; 3]> = triangles.iter().flat_map(sides).collect();
    for edge in &mut edges {
        edge[..2].sort_unstable();
    }
    edges.sort_unstable();
    edges
}

/// Returns the parabola through the three nodes of an edge as a Bézier curve. The edge of a quadratic element has this
/// shape.
fn curve(placed: &[Point], [a, b, middle]: &[usize; 3]) -> String {
    let ([ax, ay], [bx, by], [mx, my]) = (placed[*a], placed[*b], placed[*middle]);
    let control = [2.0 * mx - (ax + bx) / 2.0, 2.0 * my - (ay + by) / 2.0];
    format!("M{ax:.2} {ay:.2}Q{:.2} {:.2} {bx:.2} {by:.2}", control[0], control[1])
}

fn draw_group(svg: &mut Svg, placed: &[Point], group: &EdgeGroup) {
    let path: String = group.edges.iter().map(|edge| curve(placed, edge)).collect();
    svg.path(&path, Stroke::solid(group.color, GROUP_WIDTH));
    let Some([dx, dy]) = group.arrows else { return };
    let length = dx.hypot(dy);
    for &[a, b, _] in &group.edges {
        for node in [a, b] {
            let [x, y] = placed[node];
            // The vertical axis of the page points down.
            let to = [x + ARROW * dx / length, y - ARROW * dy / length];
            arrow::draw(svg, [x, y], to, Stroke::solid(group.color, 0.7));
        }
    }
}
