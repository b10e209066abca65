// Which tick everybody looks at, and what was in it: the event "moment" is always that of `bus.selection.tick`.
//
// While `bus.selection.follow` holds, the tick is the run's last. One question is open at a time, so that scrubbing asks only as fast as
// the server answers, and what is asked next is what is wanted then.

export function followMoments(bus) {
  let open = false, shown = "";

  async function look() {
    const { tick } = bus.selection;
    const key = `${bus.latest("run")?.key} ${tick}`;
    if (tick === null || open || key === shown) return;
    open = true;
    try {
      const moment = await bus.ask("time.moment", { tick });
      shown = key;
      bus.tell("moment", moment);
    } catch {
      shown = ""; // the tick is not there any more; the next state says which are
    }
    open = false;
    if (`${bus.latest("run")?.key} ${bus.selection.tick}` !== key) look();
  }

  // One event "run" for both sources: { source, open, going, first, last, tick_ms, levels, key }.
  function tell() {
    const live = bus.latest("run.state"), time = bus.latest("time.state");
    if (!live || !time) return;
    const log = time.source === "log";
    const run = log ? { ...time, open: true, going: false } : { ...live, source: "live" };
    run.key = log ? `log ${time.name} ${live.open}` : `live ${live.era} ${live.last} ${live.undo}`;
    bus.tell("run", run);
    if (!run.open) return;
    const { tick, follow } = bus.selection;
    if (tick === null || tick > run.last || tick < run.first || (follow && tick !== run.last)) {
      const to = log && run.finding && tick === null ? run.finding.tick : run.last;
      bus.select({ tick: follow ? run.last : Math.max(run.first, Math.min(run.last, tick ?? to)) });
    }
    look();
  }

  let source = "";
  bus.on("time.state", (state) => {
    const now = `${state.source} ${state.name ?? ""}`;
    if (now !== source) {
      source = now;
      const at = state.source === "log" ? { tick: state.finding?.tick ?? state.first, follow: false } : { tick: null, follow: true };
      bus.select(at);
    }
    tell();
  });
  bus.on("run.state", tell);
  bus.on("selection", (_, changed) => { if (changed?.has("tick")) look(); });
}

/** Look at a tick, and stay there; the last one is followed on. */
export function lookAt(bus, tick) {
  const run = bus.latest("run");
  if (!run?.open || tick === null || tick === undefined) return;
  const to = Math.max(run.first, Math.min(run.last, Math.round(tick)));
  bus.select({ tick: to, follow: run.source === "live" && to === run.last });
}
