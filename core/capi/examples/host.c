/* Output on a host. */

#include <stdio.h>

#include "example.h"

void print(const char *text)
{
    fputs(text, stdout);
}
