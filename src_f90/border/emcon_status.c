/* What the codes of emcon.h mean, for programs that have nothing else to say. */
#include "emcon.h"

const char *emcon_status_text(int status)
{
   switch (status) {
   case EMCON_OK:
      return "done";
   case EMCON_ERROR_INPUT:
      return "a deck or an argument is wrong";
   case EMCON_ERROR_ANALYSIS:
      return "the analysis failed";
   case EMCON_ERROR_FILE:
      return "a file cannot be read or written";
   case EMCON_ERROR_INTERNAL:
      return "a broken invariant: a bug of the library";
   case EMCON_ERROR_INTERRUPT:
      return "a callback asked to stop";
   default:
      return "no code of this library";
   }
}
