// What the studio is about may be another thing after the start page was used: every page that is open goes with it.

export function followStart(bus, hear) {
  let number;
  bus.on("start.state", (state) => {
    if (number !== undefined && state.number !== number) return location.assign("./");
    number = state.number;
    return hear(state);
  });
}
