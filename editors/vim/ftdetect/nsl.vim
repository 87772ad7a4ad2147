autocmd BufRead,BufNewFile *.nsl setfiletype nsl
