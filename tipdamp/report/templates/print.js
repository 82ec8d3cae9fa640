// plots follow the width of a printed page, and go back
const plots = () => document.querySelectorAll(".plotly-graph-div");
addEventListener("beforeprint", () => plots().forEach(plot => {
  plot.dataset.height = plot.layout.height;
  Plotly.relayout(plot, {width: 680, height: Math.round((plot.layout.scene ? 0.8 : 0.95) * plot.layout.height)});
}));
addEventListener("afterprint", () => plots().forEach(plot =>
  Plotly.relayout(plot, {autosize: true, width: null, height: Number(plot.dataset.height)})));
