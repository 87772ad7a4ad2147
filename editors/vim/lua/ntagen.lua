-- Starts the language server `ntagen lsp` in Neovim 0.7 and later: require("ntagen").setup()

local M = {}

local OWN = { nsl = true, xta = true, uppaalquery = true }
local MODEL = "<nta[%s>]"
local LINES_BEFORE_ROOT = 30

-- Of XML files, only models of UPPAAL have answers.
local function is_served(buffer)
  local filetype = vim.api.nvim_buf_get_option(buffer, "filetype")
  if filetype ~= "xml" then
    return OWN[filetype] or false
  end
  for _, line in ipairs(vim.api.nvim_buf_get_lines(buffer, 0, LINES_BEFORE_ROOT, false)) do
    if line:find(MODEL) or line:match("<nta$") then
      return true
    end
  end
  return false
end

local function refresh_lenses(buffer)
  vim.api.nvim_create_autocmd({ "BufEnter", "CursorHold", "InsertLeave" }, {
    buffer = buffer,
    callback = function() vim.lsp.codelens.refresh() end,
  })
end

-- options.cmd: the command, a word each; options.on_attach: called with the client and the buffer.
function M.setup(options)
  options = options or {}
  local client

  local function on_attach(one, buffer)
    refresh_lenses(buffer)
    if options.on_attach then
      options.on_attach(one, buffer)
    end
  end

  local function attach(buffer)
    if not is_served(buffer) then
      return
    end
    if not client or not vim.lsp.get_client_by_id(client) then
      client = vim.lsp.start_client({
        name = "ntagen",
        cmd = options.cmd or { "ntagen", "lsp" },
        on_attach = on_attach,
        -- Neovim asks for lenses anew when the answer of a query has come.
        handlers = {
          ["workspace/codeLens/refresh"] = function()
            vim.lsp.codelens.refresh()
            return vim.NIL
          end,
        },
        capabilities = vim.tbl_deep_extend("force", vim.lsp.protocol.make_client_capabilities(), {
          workspace = { codeLens = { refreshSupport = true } },
        }),
      })
    end
    vim.lsp.buf_attach_client(buffer, client)
  end

  vim.api.nvim_create_autocmd("FileType", {
    pattern = { "nsl", "xta", "uppaalquery", "xml" },
    callback = function(event) attach(event.buf) end,
  })
end

return M
