// Every view: its name, what it is called, and its module with `mount(root, bus)`, which may return { shown(), hidden() }.
// A view is mounted when it is first shown, and stays.

export const VIEWS = [
  { name: "run", title: "Levels", load: () => import("./run.js") },
  { name: "tables", title: "Tables", load: () => import("./tables/grid.js") },
  { name: "graph", title: "Graph", load: () => import("./tables/graph.js") },
  { name: "cell", title: "Cell", load: () => import("./cell.js") },
  { name: "plots", title: "Curves", load: () => import("./plots.js") },
];

/** What stands below the views. */
export const BELOW = { load: () => import("./timeline.js") };
