/* Recipes in flash. The assembler searches for the files in the directory of the option -Wa,-I. */

.macro recipe name, file
    .global \name\()_begin
    .global \name\()_end
\name\()_begin:
    .incbin "\file"
\name\()_end:
.endm

    .section .rodata
    recipe phong, "paper/phong-n8.recipe"
    recipe cook_torrance, "paper/cook-torrance-n8.recipe"
    recipe neural, "paper/neural-n8.recipe"
    recipe linear, "paper/linear-n8.recipe"
    recipe completed, "completed/neural-n8.recipe"

#ifdef __ELF__
    .section .note.GNU-stack, "", %progbits
#endif
