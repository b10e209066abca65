// Every view: its name, what it is called, and its module with `mount(root, bus)`, which may return { shown(), hidden() }.
// A view is mounted when it is first shown, and stays. Where there are tables alone, and no system, those that are of a run are not offered.

export const VIEWS = [
  { name: "run", title: "Levels", ofRun: true, load: () => import("./run.js") },
  { name: "tables", title: "Tables", load: () => import("./tables/grid.js") },
  { name: "graph", title: "Graph", load: () => import("./tables/graph.js") },
  { name: "cell", title: "Cell", ofRun: true, load: () => import("./cell.js") },
  { name: "plots", title: "Curves", ofRun: true, load: () => import("./plots.js") },
  { name: "system", title: "System", ofRun: true, load: () => import("./system.js") },
];

/** What the view of the levels has below them, by the key that shows it from everywhere: [key, what, its name]. */
export const DRAWER = [["c", "Type a command of the shell", "console"], ["i", "Order a level", "script"], ["b", "Breakpoints, faults, broken buffers", "breaks"],
  ["p", "Proof, findings and logs", "found"], ["q", "Requirements, as they stand", "required"], ["v", "Variables of the level chosen", "values"]];

/** What stands below the views. */
export const BELOW = { load: () => import("./timeline.js") };
