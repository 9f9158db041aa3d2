// Curves with zoom and cursor values.

/** Charts drawn so far, by their groups; the charts of a group share the range of x. */
const linked = new Map();

/** Largest number of curves with a legend; the names of more appear at the cursor. */
const MOST_NAMES = 6;

/** Returns whether numbers are a few integers, which need no ticks between them. */
function isCount(values) {
  const all = [...values];
  return all.length > 0 && all.every(Number.isInteger) && Math.max(...all) - Math.min(...all) < 20;
}

/** Returns the description of an axis for the chart library. */
function axisOf({ label, unit, log }, columns) {
  const counts = !log && columns.length > 0 && columns.every((number) => column(number).length < 1000 && isCount(column(number)));
  return {
    title: { text: label + (unit ? ` (${unit})` : ""), standoff: 6 },
    type: log ? "log" : "linear",
    dtick: counts ? 1 : undefined,
    exponentformat: "power",
    gridcolor: styleColor("--line"),
    zerolinecolor: styleColor("--line"),
    automargin: true,
  };
}

/** Returns the layout common to all charts. */
function layoutOf(chart) {
  const { series } = chart;
  const hasLegend = series.length > 1 && series.length <= MOST_NAMES;
  const columns = (axis) => series.map((own) => own[axis]).filter((number) => number !== undefined);
  return {
    title: chart.title ? { text: chart.title, font: { size: 13 }, x: 0, xref: "paper", y: 0.98, yanchor: "top" } : undefined,
    margin: { l: 64, r: 12, t: 12 + (chart.title ? 22 : 0) + (hasLegend ? 22 : 0), b: 44 },
    height: 300,
    paper_bgcolor: "rgba(0,0,0,0)",
    plot_bgcolor: "rgba(0,0,0,0)",
    font: { color: styleColor("--ink"), size: 12 },
    hovermode: series.length <= MOST_NAMES && series.some((own) => own.lines) ? "x" : "closest",
    hoverlabel: { namelength: -1 },
    showlegend: hasLegend,
    legend: { orientation: "h", x: 0, y: 1, yanchor: "bottom" },
    colorway: DATA.colors,
    modebar: { bgcolor: "rgba(0,0,0,0)", color: styleColor("--soft"), activecolor: styleColor("--ink") },
    xaxis: axisOf(chart.x, columns("x")),
    yaxis: axisOf(chart.y, columns("y")),
  };
}

/** Returns the traces of a chart, with the unit in the text at the cursor. */
function tracesOf(chart) {
  return chart.series.map((series) => ({
    type: "scatter",
    mode: [series.lines && "lines", series.marks && "markers"].filter(Boolean).join("+"),
    name: series.name,
    x: column(series.x),
    y: column(series.y),
    line: { width: 1.5 },
    marker: { size: 6 },
    hovertemplate: `%{x:.6g} ${chart.x.unit}, %{y:.6g} ${chart.y.unit}<extra>${series.name}</extra>`,
  }));
}

/** Highlights the curves with a name in linked charts, or shows all of them again. */
function highlight(link, name) {
  for (const chart of linked.get(link)) {
    if (!chart.data.some((trace) => trace.name === name)) continue;
    chart.highlighted = chart.highlighted === name ? null : name;
    const opacity = chart.data.map((trace) => (chart.highlighted === null || trace.name === name ? 1 : 0.12));
    Plotly.restyle(chart, { opacity });
  }
}

const OPTIONS = { responsive: true, displaylogo: false, modeBarButtonsToRemove: ["lasso2d", "select2d"] };

/** Draws a chart into an element and links its range of x. */
function draw(place, chart) {
  Plotly.newPlot(place, tracesOf(chart), layoutOf(chart), OPTIONS);
  if (!chart.link) return;
  const others = linked.get(chart.link) ?? [];
  linked.set(chart.link, [...others, place]);
  if (chart.series.length > 1) place.on("plotly_click", ({ points }) => highlight(chart.link, points[0].data.name));
  place.on("plotly_relayout", (change) => {
    const range = change["xaxis.range"] ?? [change["xaxis.range[0]"], change["xaxis.range[1]"]];
    const isReset = change["xaxis.autorange"];
    if (!isReset && range[0] === undefined) return;
    for (const other of linked.get(chart.link)) {
      const axis = other.layout.xaxis;
      const isSame = isReset ? axis.autorange : axis.range[0] === range[0] && axis.range[1] === range[1];
      if (!isSame) Plotly.relayout(other, isReset ? { "xaxis.autorange": true } : { "xaxis.range": [...range] });
    }
  });
}

/** Replaces the pictures of curves by charts as they come into view. */
function startCharts() {
  const replace = (figure) => {
    const places = figure.dataset.charts.split(" ").map((number) => {
      const place = element("div", { className: "chart" });
      figure.append(place);
      draw(place, DATA.charts[number]);
      return place;
    });
    if (places.length) figure.querySelector("svg").remove();
  };
  const observer = new IntersectionObserver((entries) => {
    for (const { isIntersecting, target } of entries) {
      if (isIntersecting) {
        observer.unobserve(target);
        replace(target);
      }
    }
  }, { rootMargin: "400px" });
  document.querySelectorAll("[data-charts]").forEach((figure) => observer.observe(figure));
}
