// What a clipboard holds, as spreadsheets write it: lines of cells between tabs.

/** The cells of a text; one in quotes may hold tabs, line ends and doubled quotes. */
export function cellsOf(text) {
  const rows = [[]], all = text.replace(/\r\n?/g, "\n").replace(/\n$/, "");
  const cell = /(?:"((?:[^"]|"")*)"|([^\t\n]*))(\t|\n|$)/y;
  for (;;) {
    const [, quoted, plain, end] = cell.exec(all);
    rows.at(-1).push((quoted === undefined ? plain : quoted.replaceAll('""', '"')).trim());
    if (!end) return rows;
    if (end === "\n") rows.push([]);
  }
}

/** The text of cells, as spreadsheets read it: in quotes where one holds any at its beginning. */
export function textOf(rows) {
  return rows.map((row) => row.map((cell) => (cell.startsWith('"') ? `"${cell.replaceAll('"', '""')}"` : cell)).join("\t")).join("\n");
}

/** The cells again and again, where a selection has room for several of them, and for no piece of one. */
export function filling(cells, lines, columns) {
  const many = cells.length, most = Math.max(...cells.map((row) => row.length));
  if (lines % many || columns % most) return cells;
  return Array.from({ length: lines }, (_, line) => Array.from({ length: columns }, (__, column) => cells[line % many][column % most] ?? ""));
}
