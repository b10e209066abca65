// The editor of a text: CodeMirror, with colours, findings, offers and words about names that the server gives.
//
// In: a text that others may change, findings, colours. Out: what is typed, and where the cursor is. What it knows of the language comes of
// the server alone: the page has no second parser.

import { make } from "../bus.js";
import { autocompletion, closeCompletion, completionKeymap } from "../vendor/codemirror/autocomplete/index.js";
import { defaultKeymap } from "../vendor/codemirror/commands/index.js";
import { nextDiagnostic, openLintPanel, previousDiagnostic, setDiagnostics } from "../vendor/codemirror/lint/index.js";
import { highlightSelectionMatches, search, searchKeymap } from "../vendor/codemirror/search/index.js";
import { Annotation, EditorSelection, EditorState, Prec, RangeSet, StateEffect, StateField } from "../vendor/codemirror/state/index.js";
import { Decoration, drawSelection, EditorView, gutter, GutterMarker, highlightActiveLine, hoverTooltip, keymap, lineNumbers, runScopeHandlers } from "../vendor/codemirror/view/index.js";
import { spoken } from "../make.js";

const THEIRS = Annotation.define(); // a change that nobody typed here
const SHOWS = 8; // findings of a line that are told at its number

/** Make an editor in an element; `on` has `typed`, `moved`, `undo`, `redo`, and what is asked of places: `offers`, `about`, `declared`, `key`. */
export class Editor {
  #view; #colours = StateEffect.define(); #marks = StateEffect.define();
  #doing = null; #later = []; // a key that the server is doing, and what was pressed and typed meanwhile

  constructor(parent, on) {
    const kept = (effect) => StateField.define({
      create: () => RangeSet.empty,
      update: (held, { changes, effects }) => effects.find((one) => one.is(effect))?.value ?? held.map(changes),
    });
    const colours = kept(this.#colours), marks = kept(this.#marks);
    const run = (act) => () => { act(); return true; };
    const inTable = (act) => (view) => inRow(view.state) && (this.#do(act), true);
    this.#view = new EditorView({ parent, state: EditorState.create({ doc: "", extensions: [
      EditorState.lineSeparator.of("\n"), EditorState.tabSize.of(2), EditorState.allowMultipleSelections.of(true),
      EditorView.clipboardInputFilter.of((text) => text.replace(/\r\n?/g, "\n")),
      gutter({ class: "cm-found", markers: (view) => view.state.field(marks), initialSpacer: () => new Mark("✗", "") }), marks,
      lineNumbers(), drawSelection(), highlightActiveLine(), highlightSelectionMatches(), search({ top: true }),
      colours, EditorView.decorations.from(colours),
      hoverTooltip(async (view, pos) => said(view, pos, on)),
      autocompletion({ override: [(context) => offered(context, on)], icons: false, maxRenderedOptions: 60 }),
      keymap.of([
        { key: "Mod-z", run: run(on.undo), preventDefault: true }, { key: "Mod-y", run: run(on.redo), preventDefault: true }, { key: "Mod-Shift-z", run: run(on.redo), preventDefault: true },
        { key: "F8", run: nextDiagnostic }, { key: "Shift-F8", run: previousDiagnostic }, { key: "Mod-.", run: openLintPanel }, { key: "F12", run: run(on.declared) },
        { key: "Ctrl-Alt-Enter", run: inTable(() => on.key("line")) }, { key: "Ctrl-Alt-i", run: inTable(() => on.key("column")) },
        ...completionKeymap,
        { key: "Tab", run: inTable(() => on.key("next")) }, { key: "Shift-Tab", run: inTable(() => on.key("previous")) },
        ...searchKeymap, ...defaultKeymap.filter(({ key }) => key !== "Mod-Alt-\\"),
      ]),
      EditorView.contentAttributes.of({ class: "text-area", "aria-label": "Text of the file", spellcheck: "false", autocapitalize: "off" }),
      Prec.highest(EditorView.domEventHandlers({ keydown: (event, view) => {
        if (!this.#doing || event.ctrlKey || event.metaKey || event.altKey || event.key.length === 1 || /^(Shift|Escape|Dead|Process|Unidentified)$/.test(event.key)) return false;
        this.#later.push(() => runScopeHandlers(view, event, "editor"));
        event.preventDefault();
        return true;
      } })),
      EditorView.domEventHandlers({ beforeinput: (event, view) => {
        if (this.#doing && event.inputType === "insertText" && event.data !== null && !view.composing) {
          this.#later.push(() => view.dispatch(view.state.replaceSelection(event.data), { userEvent: "input.type", scrollIntoView: true }));
        } else if (event.inputType === "historyUndo") on.undo();
        else if (event.inputType === "historyRedo") on.redo();
        else if (event.inputType === "insertText" && event.data !== null && !view.composing && !view.state.selection.main.empty) {
          view.dispatch(view.state.replaceSelection(event.data), { userEvent: "input.type", scrollIntoView: true }); // a browser joins lines with styles of its own, which the policy refuses
        } else return false;
        event.preventDefault();
        return true;
      } }),
      EditorView.updateListener.of((update) => {
        const own = update.transactions.filter((one) => one.docChanged && !one.annotation(THEIRS));
        if (own.length) on.typed(own.some((one) => one.isUserEvent("input.type") && barTyped(one)));
        else if (update.selectionSet && update.transactions.some((one) => one.isUserEvent("select"))) on.moved();
      }),
    ] }) });
    parent.editor = this; // for who looks at the page from outside
  }

  /** Do what the server does for a key; what is pressed and typed meanwhile is done after it, where the cursor is then. */
  #do(act) {
    this.#doing = act().finally(() => {
      this.#doing = null;
      while (!this.#doing && this.#later.length) this.#later.shift()();
    });
  }

  /** Wait until all that was pressed and typed is in the text. */
  async done() {
    while (this.#doing) await this.#doing.catch(() => {});
  }

  get text() {
    return this.#view.state.doc.toString();
  }

  get focused() {
    return this.#view.hasFocus;
  }

  focus() {
    this.#view.focus();
  }

  /** Where the cursor is: line and column from 0. */
  get place() {
    const { doc, selection } = this.#view.state;
    const line = doc.lineAt(selection.main.head);
    return [line.number - 1, selection.main.head - line.from];
  }

  /** Put a piece of another text in; the cursor stays where it was in what did not change. */
  replace({ start, end, put }) {
    this.#view.dispatch({ changes: { from: start, to: end, insert: put }, annotations: THEIRS.of(true) });
  }

  /** Another file's text: the cursor and the window begin anew. */
  begin(text) {
    closeCompletion(this.#view);
    this.#later = []; // was meant for the other
    this.#view.dispatch({ changes: { from: 0, to: this.#view.state.doc.length, insert: text }, selection: { anchor: 0 }, annotations: THEIRS.of(true), effects: [this.#colours.of(RangeSet.empty), EditorView.scrollIntoView(0)] });
  }

  /** Put the cursor at a place. */
  go([line, column], to = null) {
    const at = this.#offset(line, column), past = to ? this.#offset(...to) : at;
    this.#view.dispatch({ selection: EditorSelection.single(at, past), effects: EditorView.scrollIntoView(at, { y: "nearest", x: "nearest", yMargin: 40 }) });
  }

  /** Bring a line into sight, if it is not. */
  show(line) {
    this.#view.dispatch({ effects: EditorView.scrollIntoView(this.#offset(line, 0), { y: "nearest", yMargin: 60 }) });
  }

  #offset(line, column) {
    const { doc } = this.#view.state;
    if (line >= doc.lines) return doc.length;
    const found = doc.line(line + 1);
    return Math.min(found.to, found.from + column);
  }

  /** Show what is found: `area`, `severity`, `message`, and `tell()`, which makes the words. */
  found(findings) {
    const shown = findings.map(({ area: [start, end], severity, message, tell }) => {
      const from = this.#offset(...start), to = Math.max(from, this.#offset(...end));
      return { from, to, severity: severity === "note" ? "info" : severity, message, renderMessage: tell };
    });
    const lines = Map.groupBy(shown, ({ from }) => this.#view.state.doc.lineAt(from).from);
    const marks = [...lines].sort(([one], [other]) => one - other).map(([from, several]) =>
      new Mark(several.some(({ severity }) => severity === "error") ? "✗" : "•", several.slice(0, SHOWS).map(({ message }) => message).join("\n")).range(from));
    this.#view.dispatch(setDiagnostics(this.#view.state, shown), { effects: this.#marks.of(RangeSet.of(marks)) });
  }

  /** Colour words: line, column, length and type, one after another. */
  coloured({ types, tokens }) {
    const ranges = [];
    for (let at = 0; at < tokens.length; at += 4) {
      const from = this.#offset(tokens[at], tokens[at + 1]), to = Math.min(this.#view.state.doc.length, from + tokens[at + 2]);
      if (from < to) ranges.push((WORDS[types[tokens[at + 3]]] ??= Decoration.mark({ class: `word-${types[tokens[at + 3]]}` })).range(from, to));
    }
    this.#view.dispatch({ effects: this.#colours.of(RangeSet.of(ranges)) });
  }
}

const WORDS = {};

class Mark extends GutterMarker {
  constructor(sign, title) {
    super();
    Object.assign(this, { sign, title });
  }

  eq(other) {
    return other.sign === this.sign && other.title === this.title;
  }

  toDOM() {
    return make("span", { class: this.sign === "✗" ? "error" : "note", title: this.title }, this.sign);
  }
}

/** Whether the cursor is in a row of a table. */
const inRow = ({ doc, selection }) => doc.lineAt(selection.main.head).text.trimStart().startsWith("|");

function barTyped({ changes }) {
  let typed = false;
  changes.iterChanges((_from, _to, _start, _end, inserted) => { typed ||= inserted.toString().includes("|"); });
  return typed;
}

/** Where a place of a state is: line and column from 0. */
function placed({ doc }, pos) {
  const line = doc.lineAt(pos);
  return [line.number - 1, pos - line.from];
}

async function offered(context, on) {
  const word = context.matchBefore(/\w*$/);
  const before = context.state.sliceDoc(Math.max(0, word.from - 1), word.from);
  if (!context.explicit && word.from === word.to && !".|:=".includes(before || " ")) return null;
  const found = await on.offers(placed(context.state, context.pos), context);
  if (!found?.length || context.aborted) return null;
  const options = found.map(({ label, detail, doc }, at) => ({ label, detail, info: doc || undefined, boost: -Math.min(98, at / 4) }));
  return { from: word.from, options, validFor: /^\w*$/ };
}

async function said({ state }, pos, on) {
  const about = await on.about(placed(state, pos));
  if (!about) return null;
  const line = state.doc.line(about.start[0] + 1);
  return { pos: line.from + about.start[1], end: line.from + about.end[1], above: true, create: () => ({ dom: make("div", { class: "about" }, ...markdown(about.text)) }) };
}

/** The little Markdown that the server writes: paragraphs, code, what is strong or stressed. */
export function markdown(text) {
  return text.split(/\n\n+/).map((part) => {
    const code = /^```\w*\n([^]*?)\n?```$/.exec(part);
    if (code) return make("pre", { class: "code" }, code[1]);
    return make("p", {}, ...part.replace(/^_(.*)_$/, "$1").split(/\*\*([^*]+)\*\*/).flatMap((piece, at) => (at % 2 ? [make("strong", {}, ...spoken(piece))] : spoken(piece))));
  });
}
