" Vim syntax file for UPPAAL's textual models (.xta, .ta)
if exists("b:current_syntax")
  finish
endif

syntax keyword xtaStatement process state init trans urgent commit location branchpoint system select guard sync
syntax keyword xtaStatement assign probability query progress gantt before_update after_update priority dynamic
syntax keyword xtaKeyword if else for while do return default assert import spawn exit IO
syntax keyword xtaType int bool clock chan double string void scalar struct typedef
syntax keyword xtaType const meta hybrid broadcast
syntax keyword xtaOperator and or not imply xor forall exists sum
syntax keyword xtaConstant true false
syntax match xtaNumber /\<\d\+\(\.\d\+\)\?\([eE][+-]\?\d\+\)\?\>/
syntax region xtaString start=/"/ end=/"/ oneline
syntax match xtaComment /\/\/.*$/ contains=@Spell
syntax region xtaComment start=/\/\*/ end=/\*\// contains=@Spell

highlight default link xtaStatement Statement
highlight default link xtaKeyword Keyword
highlight default link xtaType Type
highlight default link xtaOperator Operator
highlight default link xtaConstant Boolean
highlight default link xtaNumber Number
highlight default link xtaString String
highlight default link xtaComment Comment

let b:current_syntax = "xta"
