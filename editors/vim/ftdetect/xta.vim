autocmd BufRead,BufNewFile *.xta,*.ta setfiletype xta
autocmd BufRead,BufNewFile *.q setfiletype uppaalquery
