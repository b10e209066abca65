-- What a user of Neovim sees and does; `tests.clients.nvim` runs it.
local function check(held, what)
  if held then return end
  io.stderr:write("wrong: " .. what .. "\n" .. table.concat(vim.api.nvim_buf_get_lines(0, 0, -1, false), "\n") .. "\n")
  vim.cmd("cquit 1")
end

local function wait(what, holds)
  check(vim.wait(120000, holds, 20), what)
end

local function text()
  return table.concat(vim.api.nvim_buf_get_lines(0, 0, -1, false), "\n")
end

local function press(keys)
  vim.api.nvim_feedkeys(vim.api.nvim_replace_termcodes(keys, true, false, true), "xt", false)
end

local function place()
  local at = vim.api.nvim_win_get_cursor(0)
  return at[1] .. ":" .. at[2]
end

local function line(name)
  for at, each in ipairs(vim.api.nvim_buf_get_lines(0, 0, -1, false)) do
    if each:match("^%s*| " .. name .. " ") then return at end
  end
end

local function errors()
  return vim.diagnostic.get(0, { severity = vim.diagnostic.severity.ERROR })
end

local function run()
  local rcsc = require("rcsc")
  vim.cmd("filetype on")
  rcsc.setup({ command = { vim.g.rcsc, "lsp" } })
  vim.cmd("edit!")
  check(vim.bo.filetype == "rcs", "the file is known as rcs")

  wait("the overlap is found", function() return #errors() == 1 end)
  check(errors()[1].message:find("`rise` and `top`", 1, true), errors()[1].message)
  check(errors()[1].message:find("height_mm = 1900", 1, true), "with the least input")
  wait("the state is told", function() return rcsc.status():find("refuted", 1, true) end)
  local marks = vim.api.nvim_buf_get_extmarks(0, vim.api.nvim_get_namespaces().rcsc, 0, -1, { details = true })
  check(#marks == 1 and marks[1][4].virt_text[1][1]:find("refuted: lines", 1, true), "the heading says it")

  vim.api.nvim_win_set_cursor(0, { errors()[1].lnum + 1, errors()[1].col })
  check(rcsc.table_here() == "door", "the cursor stands in the table")
  local witness = rcsc.show("rcsc.witness")
  check(witness and witness.text:find("2 of 6 lines match", 1, true), "the witness is run")
  local proof = rcsc.show("rcsc.prove")
  check(proof and proof.text:find("refuted", 1, true), "the proof anew says the same")

  local here = vim.lsp.util.make_range_params()
  here.context = { diagnostics = {}, only = { "quickfix" } }
  local answers = vim.lsp.buf_request_sync(0, "textDocument/codeAction", here, 60000)
  local _, answer = next(answers)
  local action = answer.result and answer.result[1]
  check(action and action.title:find("proved", 1, true), "a proved repair is offered")
  vim.lsp.util.apply_workspace_edit(action.edit, "utf-16")
  wait("nothing is wrong any more", function() return #errors() == 0 end)
  wait("and that is told", function() return rcsc.status():find("door: proved", 1, true) end)

  local _, drawing = rcsc.show("rcsc.graph")
  check(drawing and table.concat(vim.fn.readfile(drawing)):find("<svg", 1, true), "the graph is drawn")

  vim.api.nvim_win_set_cursor(0, { line("rest"), 4 })
  local before, places = text(), {}
  for _ = 1, 3 do
    press("i<Tab><Esc>")
    places[#places + 1] = place()
  end
  check(text() == before, "tab writes nothing in a table")
  check(places[1] ~= places[2] and places[2] ~= places[3], "and goes on: " .. table.concat(places, " "))
  vim.api.nvim_win_set_cursor(0, { 1, 0 })
  press("i<Tab><Esc>")
  check(text() ~= before, "elsewhere tab is a tab")
  vim.cmd("undo")
  check(text() == before, "undo takes it back")

  vim.api.nvim_win_set_cursor(0, { line("low"), 4 })
  local lines = vim.api.nvim_buf_line_count(0)
  press("<Space>ra")
  check(vim.api.nvim_buf_line_count(0) == lines + 1, "a line is added")
  check(rcsc.status():find("stale", 1, true), "nobody has looked yet: " .. rcsc.status())
  wait("the new line is looked at", function() return #errors() > 0 end)
  vim.cmd("undo")
  wait("and taken back", function() return #errors() == 0 and rcsc.status():find("proved", 1, true) end)
  press("<Space>ri")
  local at = line("low")
  check(#vim.fn.getline(at) ~= #vim.split(before, "\n")[at], "a column is inserted")
  vim.cmd("undo")
  io.stderr:write("all of it is as it should be\n")
  vim.cmd("qall!")
end

local done, wrong = xpcall(run, debug.traceback)
if not done then
  io.stderr:write(tostring(wrong) .. "\n")
  vim.cmd("cquit 1")
end
