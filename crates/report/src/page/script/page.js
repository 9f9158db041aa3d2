/** Shows why a part of the page stays a picture. */
function keepPicture(place, error) {
  place.querySelector("canvas")?.remove();
  place.append(element("p", { className: "note" }, `Shown as a picture only: ${error.message}`));
}

async function start() {
  for (const place of document.querySelectorAll("[data-body]")) {
    try {
      startBody(place, DATA.bodies[place.dataset.body]);
    } catch (error) {
      keepPicture(place, error);
    }
  }
  if (await loadLibrary()) {
    startCharts();
    const place = document.querySelector("[data-analysis]");
    if (place) {
      startAnalysis(place, DATA.traces);
      place.closest("details").hidden = false;
    }
  }
  document.documentElement.dataset.state = "ready";
}

start();
