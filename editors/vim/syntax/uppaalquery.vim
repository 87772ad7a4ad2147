" Vim syntax file for UPPAAL's files of queries (.q)
if exists("b:current_syntax")
  finish
endif

syntax match queryPath /\<[AE]\(\[\]\|<>\)\|-->/
syntax keyword queryPath control control_t minE maxE minPr maxPr Pr Pmax simulate sup inf bounds
syntax keyword queryPath strategy under imitate saveStrategy loadStrategy
syntax keyword queryOperator and or not imply xor forall exists sum foreach numOf sat int scalar location system
syntax keyword queryConstant true false deadlock
syntax match queryNumber /\<\d\+\(\.\d\+\)\?\([eE][+-]\?\d\+\)\?\>/
syntax region queryString start=/"/ end=/"/ oneline
syntax match queryComment /\/\/.*$/ contains=@Spell
syntax region queryComment start=/\/\*/ end=/\*\// contains=@Spell

highlight default link queryPath Statement
highlight default link queryOperator Operator
highlight default link queryConstant Boolean
highlight default link queryNumber Number
highlight default link queryString String
highlight default link queryComment Comment

let b:current_syntax = "uppaalquery"
