-- Neovim, 0.7 or later, for rcsc state tables. Put this file into `lua/` of your configuration, and into its init.lua:
--
--   require("rcsc").setup()                                    -- `.venv/bin/rcsc lsp` of the project, else `rcsc lsp`
--   require("rcsc").setup({ command = { "/opt/bin/rcsc", "lsp" }, keys = false })
--
-- In a table, in insert mode: <Tab> and <S-Tab> go from cell to cell. In normal mode: <leader>rp proves the table anew, rg draws its graph,
-- rw runs its witness, ra adds a line, ri inserts a column, rc lists the findings, rf shows proved repairs.
-- `require("rcsc").status()` is for a status line: the state of the table under the cursor, in words.

local M = { known = {}, client = nil }

local STATES = { "proved", "proved, trusting", "conditional", "stale", "undecided", "refuted", "has errors" }
local MARKS = { proved = "v", ["proved, trusting"] = "~", conditional = "~", stale = "?", undecided = "x", refuted = "x", ["has errors"] = "x" }
local GROUPS = {
  proved = "DiagnosticHint", ["proved, trusting"] = "DiagnosticWarn", conditional = "DiagnosticWarn", stale = "Comment",
  undecided = "DiagnosticError", refuted = "DiagnosticError", ["has errors"] = "DiagnosticError",
}
local SIGNS = vim.api.nvim_create_namespace("rcsc")

local function root(file)
  local found = vim.fs and vim.fs.find and vim.fs.find({ "rcsc.toml", "system.toml", ".git" }, { path = vim.fn.fnamemodify(file, ":h"), upward = true })[1]
  if found then return vim.fn.fnamemodify(found, ":p:h") end
  for _, name in ipairs({ "rcsc.toml", "system.toml" }) do
    local up = vim.fn.findfile(name, vim.fn.fnamemodify(file, ":p:h") .. ";")
    if up ~= "" then return vim.fn.fnamemodify(up, ":p:h") end
  end
  return vim.fn.fnamemodify(file, ":p:h")
end

local function command(folder)
  local folders = { folder }
  while folder ~= vim.fn.fnamemodify(folder, ":h") do
    folder = vim.fn.fnamemodify(folder, ":h")
    folders[#folders + 1] = folder
  end
  for _, each in ipairs(folders) do
    local own = each .. "/.venv/bin/rcsc"
    if vim.fn.executable(own) == 1 then return { own, "lsp" } end
  end
  return { "rcsc", "lsp" }
end

-- What tables stand at, as the server says: a mark in the gutter, and the words behind the heading.
local function told(_, status)
  if not status or not status.uri then return end
  local buffer = vim.uri_to_bufnr(status.uri)
  M.known[buffer] = { tables = status.tables, tick = vim.api.nvim_buf_get_changedtick(buffer) }
  if not vim.api.nvim_buf_is_loaded(buffer) then return end
  vim.api.nvim_buf_clear_namespace(buffer, SIGNS, 0, -1)
  for _, entry in ipairs(status.tables) do
    local line = entry.range.start.line
    if line < vim.api.nvim_buf_line_count(buffer) then
      vim.api.nvim_buf_set_extmark(buffer, SIGNS, line, 0, {
        sign_text = MARKS[entry.state], sign_hl_group = GROUPS[entry.state], virt_text = { { entry.text, GROUPS[entry.state] } },
      })
    end
  end
end

-- A number of the protocol's columns, which count UTF-16.
local function place()
  return vim.lsp.util.make_position_params(0, "utf-16").position
end

local function clients(buffer)
  local found = {}
  for _, each in pairs((vim.lsp.get_clients or vim.lsp.buf_get_clients)(vim.lsp.get_clients and { bufnr = buffer } or buffer)) do
    if each.name == "rcsc" then found[#found + 1] = each end
  end
  return found
end

-- Asks the server to run a command, and waits for what comes of it.
local function ask(name, arguments, buffer)
  local client = clients(buffer)[1]
  if not client then return nil, "the language server does not run" end
  local answer, failed = client.request_sync("workspace/executeCommand", { command = name, arguments = arguments }, 10000, buffer)
  if not answer then return nil, failed end
  if answer.err then return nil, answer.err.message end
  return answer.result
end

-- The name of the table that the cursor stands in; nil outside.
function M.table_here()
  local at = vim.api.nvim_win_get_cursor(0)[1]
  for line = at, 1, -1 do
    local text = vim.fn.getline(line)
    local name = text:match("^%s*table%s+([%w_]+)[^}]*$")
    if name then return name end
    if line < at and text:match("^%s*}") then return nil end
  end
  return nil
end

-- A key in a table: the edits of the server, and the cursor where it says; false outside tables.
function M.move(name)
  local buffer = vim.api.nvim_get_current_buf()
  local tick = vim.api.nvim_buf_get_changedtick(buffer)
  local answer = ask(name, { vim.uri_from_bufnr(buffer), place() }, buffer)
  if not answer or answer == vim.NIL or vim.api.nvim_buf_get_changedtick(buffer) ~= tick then return false end
  vim.lsp.util.apply_text_edits(answer.edits, buffer, "utf-16")
  local line = vim.fn.getline(answer.cursor.line + 1)
  local column = vim.str_byteindex and vim.str_byteindex(line, math.min(answer.cursor.character, #line), true) or answer.cursor.character
  vim.api.nvim_win_set_cursor(0, { answer.cursor.line + 1, column })
  return true
end

-- What a lens does: a text in a window below, a drawing as a file that the system opens.
function M.show(name)
  local buffer, here = vim.api.nvim_get_current_buf(), M.table_here()
  if not here then return vim.notify("rcsc: the cursor stands in no table", vim.log.levels.WARN) end
  local answer, failed = ask(name, { vim.uri_from_bufnr(buffer), here }, buffer)
  if not answer then return vim.notify("rcsc: " .. tostring(failed), vim.log.levels.WARN) end
  if answer.form == "svg" then
    local file = vim.fn.tempname() .. ".svg"
    vim.fn.writefile(vim.split(answer.text, "\n"), file)
    local opens = vim.fn.executable("xdg-open") == 1 and "xdg-open" or vim.fn.executable("open") == 1 and "open"
    if opens and #vim.api.nvim_list_uis() > 0 then vim.fn.jobstart({ opens, file }, { detach = true }) end
    vim.notify("rcsc: " .. answer.title .. " is in " .. file)
    return answer, file
  end
  vim.lsp.util.open_floating_preview(vim.split(answer.text, "\n"), "plaintext", { border = "single", focus = false })
  return answer
end

-- For a status line: the state of the table under the cursor, else how many tables stand at what.
function M.status()
  local buffer = vim.api.nvim_get_current_buf()
  local said = M.known[buffer]
  if not said then return "" end
  local changed = vim.api.nvim_buf_get_changedtick(buffer) ~= said.tick
  local here, counts = M.table_here(), {}
  for _, entry in ipairs(said.tables) do
    local state = changed and "stale" or entry.state
    if entry.name == here then return "rcsc " .. MARKS[state] .. " " .. entry.name .. ": " .. state end
    counts[state] = (counts[state] or 0) + 1
  end
  local words = {}
  for _, state in ipairs(STATES) do
    if counts[state] then words[#words + 1] = counts[state] .. " " .. state end
  end
  return #words > 0 and "rcsc " .. table.concat(words, ", ") or ""
end

local function keys(buffer)
  local function map(mode, key, act, what, expr)
    vim.keymap.set(mode, key, act, { buffer = buffer, silent = true, desc = "rcsc: " .. what, expr = expr })
  end
  local function cell(key, name)
    map("i", key, function()
      local typed = vim.api.nvim_replace_termcodes(key, true, false, true)
      if not vim.fn.getline("."):match("^%s*|") or not M.move(name) then vim.api.nvim_feedkeys(typed, "ni", false) end
    end, "go to a cell")
  end
  cell("<Tab>", "rcsc.nextCell")
  cell("<S-Tab>", "rcsc.previousCell")
  map("n", "<leader>ra", function() M.move("rcsc.addRow") end, "add a line")
  map("n", "<leader>ri", function() M.move("rcsc.insertColumn") end, "insert a column")
  map("n", "<leader>rp", function() M.show("rcsc.prove") end, "prove the table anew")
  map("n", "<leader>rg", function() M.show("rcsc.graph") end, "draw its graph")
  map("n", "<leader>rw", function() M.show("rcsc.witness") end, "run its witness")
  map("n", "<leader>rc", function() vim.diagnostic.setloclist() end, "list the findings")
  map("n", "<leader>rf", function() vim.lsp.buf.code_action() end, "show proved repairs")
end

-- Starts the server for a buffer, or joins it to the one that runs for its project.
function M.start(buffer, options)
  local file = vim.api.nvim_buf_get_name(buffer)
  local folder = root(file)
  local config = {
    name = "rcsc", cmd = options.command or command(folder), root_dir = folder, init_options = { silent = true },
    handlers = { ["rcsc/status"] = told }, workspace_folders = { { uri = vim.uri_from_fname(folder), name = folder } },
  }
  if vim.lsp.start then
    vim.lsp.start(config, { bufnr = buffer })
  else -- before 0.8
    M.running = M.running or {}
    local id = M.running[folder]
    if not id or not vim.lsp.get_client_by_id(id) then
      id = vim.lsp.start_client(config)
      M.running[folder] = id
    end
    if id then vim.lsp.buf_attach_client(buffer, id) end
  end
  if options.keys ~= false then keys(buffer) end
end

-- Has Neovim know `*.rcs`, and start the server with each.
-- options: command, a list, what starts the server; keys, false for none.
function M.setup(options)
  options = options or {}
  local group = vim.api.nvim_create_augroup("rcsc", { clear = true })
  vim.api.nvim_create_autocmd({ "BufRead", "BufNewFile" }, { group = group, pattern = "*.rcs", command = "setfiletype rcs" })
  vim.api.nvim_create_autocmd("FileType", {
    group = group, pattern = "rcs",
    callback = function(event)
      vim.bo[event.buf].commentstring = "# %s"
      vim.bo[event.buf].expandtab, vim.bo[event.buf].shiftwidth = true, 2
      M.start(event.buf, options)
    end,
  })
end

return M
