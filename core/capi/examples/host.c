/* A host, where there is a standard output. */

#include <stdio.h>

#include "example.h"

void print(const char *text)
{
    fputs(text, stdout);
}
