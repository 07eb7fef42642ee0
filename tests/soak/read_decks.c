/* Opens decks one after the other in one process.
 *
 * usage: read_decks DECK...   prints the code of each as it goes; 1 if one was refused without a word */
#include <emcon.h>

#include <stdio.h>

int main(int argc, char **argv)
{
   for (int i = 1; i < argc; ++i) {
      emcon_model *model = NULL;
      const char *message;
      int status;

      printf("%s: ", argv[i]);
      fflush(stdout);
      status = emcon_open(argv[i], NULL, i%2, &model);
      message = status == EMCON_OK ? "" : emcon_message(model);
      printf("%d %s\n", status, message == NULL ? "" : message);
      if (status != EMCON_OK && (message == NULL || message[0] == '\0')) return 1;
      emcon_close(model);
   }
   return 0;
}
