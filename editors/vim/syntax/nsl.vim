" Vim syntax file for ntagen environments (.nsl)
" A keyword wins over a region that begins with it, so `drive` is none.
if exists("b:current_syntax")
  finish
endif

" The words that begin statements, and the other words of the grammar.
syntax keyword nslStatement bevel critical detection device environment for heading include length let
syntax keyword nslStatement motion needle push radius resolution roll safe safety speed spin step target tip tissue
syntax keyword nslStatement tracker transform unexplored wait
syntax keyword nslWord about after along and apart around as at between box by capsule cylinder ellipsoid
syntax keyword nslWord every grid halfspace in label least margin markups mesh most moves only per phase point
syntax keyword nslWord radii segment segmentation size sphere through times to towards turned while

" Values.
syntax keyword nslChoice adversarial free grbl off on openigtlink pi sampled static stochastic swept
syntax keyword nslFunction sin cos sqrt abs min max
syntax match nslNumber /\<\d\+\(\.\d\+\)\?\([eE][+-]\?\d\+\)\?/
syntax match nslUnit /\(\d\|\s\|)\)\@<=\(um\|mm\|cm\|m\|deg\|rad\|mrad\|ms\|s\|min\|mN\|N\|B\|KiB\|MiB\|GiB\)\>/
syntax match nslQuery /\<query\>.\{-}\ze\s*\(\/\/\|$\)/
syntax region nslString start=/"/ end=/"/ oneline
syntax match nslComment /\/\/.*$/ contains=@Spell
syntax region nslComment start=/\/\*/ end=/\*\// contains=@Spell

" The settings of the driver: Vim tries the last one first, which has the most words.
syntax region nslDrive matchgroup=nslStatement start=/\<drive\>\s*{/ end=/}/ contains=nslSetting,nslChoice,nslNumber,nslUnit,nslComment,nslString
syntax match nslSetting /\<spacing\>/ contained
syntax match nslSetting /\<seed\>/ contained
syntax match nslSetting /\<review\>/ contained
syntax match nslSetting /\<ranking\>/ contained
syntax match nslSetting /\<push\>/ contained
syntax match nslSetting /\<pull\>/ contained
syntax match nslSetting /\<overrun\>/ contained
syntax match nslSetting /\<accept\>/ contained
syntax match nslSetting /\<noise\>/ contained
syntax match nslSetting /\<guarantee\>/ contained
syntax match nslSetting /\<force\>/ contained
syntax match nslSetting /\<deviation\>/ contained
syntax match nslSetting /\<delay\>/ contained
syntax match nslSetting /\<clearance\>/ contained
syntax match nslSetting /\<true\s\+radius\>/ contained
syntax match nslSetting /\<true\s\+bevel\>/ contained
syntax match nslSetting /\<time\s\+limit\>/ contained
syntax match nslSetting /\<sensing\s\+margin\>/ contained
syntax match nslSetting /\<roll\s\+speed\>/ contained
syntax match nslSetting /\<roll\s\+lag\>/ contained
syntax match nslSetting /\<roll\s\+error\>/ contained
syntax match nslSetting /\<radius\s\+error\>/ contained
syntax match nslSetting /\<prior\s\+roll\>/ contained
syntax match nslSetting /\<prior\s\+position\>/ contained
syntax match nslSetting /\<prior\s\+noise\>/ contained
syntax match nslSetting /\<prior\s\+lag\>/ contained
syntax match nslSetting /\<prior\s\+heading\>/ contained
syntax match nslSetting /\<prior\s\+distortion\>/ contained
syntax match nslSetting /\<prior\s\+direction\>/ contained
syntax match nslSetting /\<prior\s\+curvature\>/ contained
syntax match nslSetting /\<prior\s\+bevel\>/ contained
syntax match nslSetting /\<prior\s\+bite\>/ contained
syntax match nslSetting /\<max\s\+plans\>/ contained
syntax match nslSetting /\<prior\s\+first\s\+curvature\>/ contained
syntax match nslSetting /\<prior\s\+shape\s\+spacing\>/ contained
syntax match nslSetting /\<whole\s\+shape\>/ contained
syntax match nslSetting /\<learned\s\+radius\>/ contained
syntax match nslSetting /\<lag\s\+compensation\>/ contained
syntax match nslSetting /\<initial\s\+push\>/ contained
syntax match nslSetting /\<halt\s\+force\>/ contained
syntax match nslSetting /\<force\s\+sensing\>/ contained
syntax match nslSetting /\<force\s\+rise\>/ contained
syntax match nslSetting /\<force\s\+noise\>/ contained
syntax match nslSetting /\<false\s\+alarm\>/ contained
syntax match nslSetting /\<felt\s\+clearance\>/ contained
syntax match nslSetting /\<engine\s\+time\>/ contained
syntax match nslSetting /\<engine\s\+memory\>/ contained
syntax match nslSetting /\<deviation\s\+count\>/ contained
syntax match nslSetting /\<detection\s\+clearance\>/ contained
syntax match nslSetting /\<pull\s\+speed\s\+ratio\>/ contained
syntax match nslSetting /\<prior\s\+turn\s\+drift\>/ contained
syntax match nslSetting /\<prior\s\+curvature\s\+drift\>/ contained
syntax match nslSetting /\<depth\s\+in\s\+target\>/ contained

highlight default link nslStatement Statement
highlight default link nslWord Keyword
highlight default link nslChoice Constant
highlight default link nslFunction Function
highlight default link nslNumber Number
highlight default link nslUnit Type
highlight default link nslQuery PreProc
highlight default link nslString String
highlight default link nslComment Comment
highlight default link nslSetting Identifier

let b:current_syntax = "nsl"
