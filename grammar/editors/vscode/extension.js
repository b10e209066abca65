// The client: starts `rcsc lsp`, shows what it says of each table, and gives its commands keys.
//
// What a table stands at is said by the server alone, in words; the gutter, the status bar and the lenses show the same words.

const fs = require("fs");
const path = require("path");
const vscode = require("vscode");
const { LanguageClient, State } = require("vscode-languageclient/node");

const LANGUAGE = "rcs";
const STATES = ["proved", "proved, trusting", "conditional", "stale", "undecided", "refuted", "has errors"];
const MARKS = { proved: "\u2713", "proved, trusting": "\u223c", conditional: "\u223c", stale: "?", undecided: "\u2717", refuted: "\u2717", "has errors": "\u2717" };
const COLOURS = {
  proved: "testing.iconPassed", "proved, trusting": "editorWarning.foreground", conditional: "editorWarning.foreground", stale: "descriptionForeground",
  undecided: "testing.iconFailed", refuted: "testing.iconFailed", "has errors": "testing.iconFailed",
};
const ON_TABLE = ["rcsc.prove", "rcsc.graph", "rcsc.witness"];
const IN_TABLE = ["rcsc.nextCell", "rcsc.previousCell", "rcsc.addRow", "rcsc.insertColumn"];

let client; // the language client, where there is one
let bar; // the status bar's item
let gutters; // a decoration by state
let pages; // the panel of each graph, by its title
const ANSWER = "rcsc-answer";
const answers = new Map(); // texts that were shown, by document
const answered = new vscode.EventEmitter();
const known = new Map(); // by document: what the server said last, {version, tables}

exports.activate = async (context) => {
  bar = vscode.window.createStatusBarItem("rcsc.status", vscode.StatusBarAlignment.Left, 50);
  bar.name = "rcsc";
  bar.command = "rcsc.check";
  gutters = new Map(STATES.map((state) => [state, gutter(state)]));
  pages = new Map();
  context.subscriptions.push(
    bar, ...gutters.values(), answered,
    vscode.workspace.registerTextDocumentContentProvider(ANSWER, { onDidChange: answered.event, provideTextDocumentContent: (uri) => answers.get(uri.toString()) ?? "" }),
    vscode.commands.registerCommand("rcsc.check", check),
    vscode.commands.registerCommand("rcsc.restart", start),
    vscode.window.onDidChangeActiveTextEditor(show),
    vscode.window.onDidChangeTextEditorSelection(show),
    vscode.workspace.onDidCloseTextDocument((document) => known.delete(document.uri.toString())),
    vscode.workspace.onDidGrantWorkspaceTrust(start),
    vscode.workspace.onDidChangeConfiguration((change) => {
      if (change.affectsConfiguration("rcsc.command") && JSON.stringify(toRun()) !== runs) start();
    }),
    vscode.workspace.onDidChangeTextDocument((change) => {
      if (vscode.window.activeTextEditor?.document === change.document) show();
    }),
  );
  await start();
};

exports.deactivate = () => client?.stop();

// --- the server ---

// One start after another: a folder that is trusted has other settings at once, and each asks for one.
let starts = Promise.resolve();
let asked = 0;
let runs = "";
function start() {
  const mine = ++asked;
  starts = starts.then(() => (mine === asked ? begin() : undefined));
  return starts;
}

async function begin() {
  await client?.stop().catch(() => undefined);
  client = undefined;
  runs = "";
  known.clear();
  if (!vscode.workspace.isTrusted) {
    say("not started: the folder is not trusted", "Files are coloured only. A language server is a program, and starts in a trusted folder.");
    return;
  }
  const [command, ...args] = toRun();
  runs = JSON.stringify([command, ...args]);
  const shut = {
    documentSelector: [{ language: LANGUAGE }],
    initializationOptions: { silent: true }, // what a lens comes to is shown here
    middleware: { executeCommand: run, provideCodeLenses: lenses },
    outputChannelName: "rcsc",
  };
  const started = new LanguageClient("rcsc", "rcsc", { command, args, options: { cwd: folder() } }, shut);
  client = started;
  started.onNotification("rcsc/status", told);
  started.onDidChangeState((change) => {
    if (client !== started) return;
    if (change.newState === State.Stopped) known.clear();
    show();
  });
  try {
    await started.start();
  } catch (error) {
    say("not started", `\`${[command, ...args].join(" ")}\` cannot be run: ${error?.message ?? error}. The setting rcsc.command says what is.`);
  }
}

// What starts the server: as the user says, else the folder's own environment, else what is on the path.
function toRun() {
  const said = vscode.workspace.getConfiguration("rcsc").get("command") ?? [];
  if (said.length) return said;
  const own = ["bin/rcsc", "Scripts/rcsc.exe"].map((name) => path.join(folder() ?? "", ".venv", name));
  const found = folder() === undefined ? undefined : own.find((name) => fs.existsSync(name));
  return [found ?? "rcsc", "lsp"];
}

function folder() {
  return vscode.workspace.workspaceFolders?.find((each) => each.uri.scheme === "file")?.uri.fsPath;
}

// --- what tables stand at ---

function told(status) {
  const uri = vscode.Uri.parse(status.uri).toString();
  known.set(uri, { version: status.version, tables: status.tables });
  show();
}

// The tables of a document; each is stale once a key was pressed, until the server has looked.
function tablesOf(document) {
  const said = known.get(document.uri.toString());
  if (!said) return [];
  if (said.version === null || said.version === document.version) return said.tables;
  return said.tables.map((table) => ({ ...table, state: "stale", why: "the text has changed", text: "stale: the text has changed" }));
}

// The table that the cursor stands in, by the text: from its heading to the brace that closes it.
function tableAt(editor) {
  const { document } = editor;
  const at = editor.selection.active.line;
  for (let line = at; line >= 0; line -= 1) {
    const text = document.lineAt(line).text;
    const name = /^[ \t]*table[ \t]+(\w+)[^}]*$/.exec(text);
    if (name) return tablesOf(document).find((table) => table.name === name[1]);
    if (line < at && /^[ \t]*}/.test(text)) return undefined;
  }
  return undefined;
}

function gutter(state) {
  return vscode.window.createTextEditorDecorationType({
    gutterIconPath: vscode.Uri.parse(`data:image/svg+xml,${encodeURIComponent(icon(state))}`),
    gutterIconSize: "contain",
    overviewRulerColor: new vscode.ThemeColor(COLOURS[state]),
    overviewRulerLane: vscode.OverviewRulerLane.Left,
  });
}

// Proved, proved of something, not looked at and not proved differ by their form, and not by colour alone.
const FORMS = {
  "\u2713": ["#388a34", "M3 8.5l3.5 3.5L13 4.5"],
  "\u223c": ["#bf8803", "M2 9c2-4 4-4 6-1s4 3 6-1"],
  "?": ["#808080", "M5.5 6a2.5 2.5 0 1 1 3.6 2.2c-.8.4-1.1.9-1.1 1.8M8 12.6v.6"],
  "\u2717": ["#d0342c", "M4 4l8 8M12 4l-8 8"],
};
function icon(state) {
  const [colour, form] = FORMS[MARKS[state]];
  return `<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 16 16"><path d="${form}" fill="none" stroke="${colour}" stroke-width="2" stroke-linecap="round"/></svg>`;
}

function show() {
  for (const editor of vscode.window.visibleTextEditors.filter((each) => each.document.languageId === LANGUAGE)) {
    const tables = tablesOf(editor.document);
    for (const [state, decoration] of gutters) {
      const marked = tables.filter((table) => table.state === state).map((table) => {
        const line = table.range.start.line;
        return { range: new vscode.Range(line, 0, line, 0), hoverMessage: `table ${table.name}: ${table.text}` };
      });
      editor.setDecorations(decoration, marked);
    }
  }
  const editor = vscode.window.activeTextEditor;
  const here = editor?.document.languageId === LANGUAGE;
  vscode.commands.executeCommand("setContext", "rcsc.inTable", Boolean(here && client?.state === State.Running && inTable(editor)));
  if (!here) { bar.hide(); return; }
  if (client?.state !== State.Running) {
    if (vscode.workspace.isTrusted && client) say("not running", "The language server does not run. Its output says why.");
    bar.show();
    return;
  }
  const tables = tablesOf(editor.document);
  const table = tableAt(editor);
  const counts = STATES.map((state) => [tables.filter((each) => each.state === state).length, state]).filter(([count]) => count);
  const all = tables.length ? counts.map(([count, state]) => `${count} ${state}`).join(", ") : "no table";
  const worst = [...STATES].reverse().find((state) => tables.some((each) => each.state === state));
  const shown = table ? `${table.name}: ${table.state}` : all;
  say(`${MARKS[table?.state ?? worst] ?? ""} ${shown}`.trim(), tables.map((each) => `${each.name}: ${each.text}`).join("\n") || all, worst);
}

function say(text, more, state) {
  bar.text = `rcsc ${text}`;
  bar.tooltip = more;
  bar.accessibilityInformation = { label: `rcsc ${text}` };
  bar.backgroundColor = state === "failed" ? new vscode.ThemeColor("statusBarItem.errorBackground") : undefined;
  bar.show();
}

// Whether the cursor stands in a row: by the text, so that keys do what they say before the server has looked.
function inTable(editor) {
  return /^\s*\|/.test(editor.document.lineAt(editor.selection.active.line).text);
}

// --- commands ---

// Commands of the server: from a lens with what they are about, from a key or the palette about where the cursor stands.
async function run(command, args, next) {
  const editor = vscode.window.activeTextEditor;
  if (IN_TABLE.includes(command) && !args.length) return editor && moved(command, editor, next);
  if (ON_TABLE.includes(command)) return shown(command, args, editor, next);
  return next(command, args);
}

async function moved(command, editor, next) {
  const { document } = editor;
  const version = document.version;
  const answer = await next(command, [document.uri.toString(), editor.selection.active]);
  if (document.version !== version) return; // another key was faster
  if (!answer) {
    if (command === "rcsc.nextCell") await vscode.commands.executeCommand("tab");
    if (command === "rcsc.previousCell") await vscode.commands.executeCommand("outdent");
    return;
  }
  const edits = answer.edits.map((edit) => [asRange(edit.range), edit.newText]);
  if (edits.length) {
    const done = await editor.edit((change) => { for (const [range, text] of edits) change.replace(range, text); });
    if (!done) return;
  }
  const at = new vscode.Position(answer.cursor.line, answer.cursor.character);
  editor.selection = new vscode.Selection(at, at);
  editor.revealRange(new vscode.Range(at, at));
}

async function shown(command, args, editor, next) {
  const table = args.length || !editor ? undefined : tableAt(editor);
  if (!args.length && !table) {
    vscode.window.showInformationMessage("The cursor stands in no table.");
    return;
  }
  const about = args.length ? args : [editor.document.uri.toString(), table.name];
  const answer = await vscode.window.withProgress({ location: vscode.ProgressLocation.Window, title: "rcsc" }, () => next(command, about));
  if (!answer) return;
  if (answer.form === "svg") panel(answer.title, answer.text);
  else await page(answer.title, answer.text);
}

// A text beside the table that is nobody's file: it asks for no name when it is closed.
async function page(title, text) {
  const uri = vscode.Uri.from({ scheme: ANSWER, path: `/${title}` });
  answers.set(uri.toString(), `${text}\n`);
  answered.fire(uri);
  const document = await vscode.languages.setTextDocumentLanguage(await vscode.workspace.openTextDocument(uri), ANSWER);
  await vscode.window.showTextDocument(document, { viewColumn: vscode.ViewColumn.Beside, preview: true, preserveFocus: true });
}

// A drawing beside the text, in a page without scripts that fetches nothing.
function panel(title, svg) {
  let drawn = pages.get(title);
  if (!drawn) {
    drawn = vscode.window.createWebviewPanel("rcsc.graph", title, { viewColumn: vscode.ViewColumn.Beside, preserveFocus: true }, { enableScripts: false, localResourceRoots: [] });
    drawn.onDidDispose(() => pages.delete(title));
    pages.set(title, drawn);
  }
  const image = `data:image/svg+xml;base64,${Buffer.from(svg, "utf8").toString("base64")}`;
  drawn.webview.html = `<!doctype html><html lang="en"><head><meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src data:; style-src 'unsafe-inline'">
<style>body { margin: 0; padding: 1rem; background: #fff; } img { max-width: 100%; }</style></head><body><img alt="${escaped(title)}" src="${image}"></body></html>`;
  drawn.reveal(undefined, true);
}

function escaped(text) {
  return text.replace(/[&<>"]/g, (char) => `&#${char.charCodeAt(0)};`);
}

// What is known of the file at once, and its findings in the panel.
async function check() {
  const editor = vscode.window.activeTextEditor;
  if (editor?.document.languageId !== LANGUAGE || client?.state !== State.Running) {
    client?.outputChannel.show(true);
    return;
  }
  const uri = editor.document.uri.toString();
  const status = await client.sendRequest("workspace/executeCommand", { command: "rcsc.status", arguments: [uri] });
  told(status);
  await vscode.commands.executeCommand("workbench.actions.view.problems");
}

// Lenses of the server, with the mark of the state in front of what it says.
async function lenses(document, token, next) {
  const found = await next(document, token);
  for (const lens of found ?? []) {
    const state = lens.command?.command === "rcsc.prove" ? STATES.find((each) => `${lens.command.title}:`.startsWith(`${each}:`)) : undefined;
    if (state) lens.command.title = `${MARKS[state]} ${lens.command.title}`;
  }
  return found;
}

function asRange(range) {
  return new vscode.Range(range.start.line, range.start.character, range.end.line, range.end.character);
}
