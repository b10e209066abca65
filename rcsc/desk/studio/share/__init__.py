r"""What is handed on: a moment of a run with the ticks around it, or a finding, as one HTML file that needs nothing else.

    ask("share.moment", {"tick": 70, "around": 200})     the ticks 0 to 270, which are scrubbed in the file
    ask("handed.finding", {"file": ..., "version": ..., "finding": 0})     the table with its witness as a row and a column

>>> from rcsc.desk.studio.share.document import bundled
>>> print(bundled([("one.js", "export const c = 1;\n")]))
"use strict";
(async () => {
const m_one_js = await (async () => {
const c = 1;
<BLANKLINE>
return { c: c };
})();
})();
<BLANKLINE>

A file has one script, made of modules of the studio's page and named by its hash in the policy (`views.pages`): its time line, levels and
curves are the studio's, and answers come of the data that stands packed in the file. The report of a run has the same part. Files say what
is known of what they show, and rest on nothing that is elsewhere. What it costs: 200 kilobytes, and half a kilobyte a tick; at most twelve
megabytes of pictures.

Modules, in the order the data flows: `film` gathers ticks, `document` makes a page of them or of a finding, `sharing` answers.
"""
