/* Opens decks in eight threads at a time, all threads the same ones, each for itself.
 *
 * usage: open_models N DECK...   N opens in all; prints how many were refused */
#include <emcon.h>

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>

enum { n_thread = 8 };

typedef struct {
   int first, n_open, n_deck, n_refused;
   char **deck;
} work_t;

static void *open_decks(void *argument)
{
   work_t *work = argument;
   for (int i = 0; i < work->n_open; ++i) {
      emcon_model *model = NULL;
      const char *deck = work->deck[(work->first + i)%work->n_deck];
      if (emcon_open(deck, NULL, 0, &model) != EMCON_OK) {
         if (work->n_refused++ == 0) fprintf(stderr, "%s: %s\n", deck, emcon_message(model));
      }
      emcon_close(model);
   }
   return NULL;
}

int main(int argc, char **argv)
{
   pthread_t thread[n_thread];
   work_t work[n_thread];
   int n_refused = 0;
   if (argc < 3) return 2;
   for (int i = 0; i < n_thread; ++i) {
      /* In pairs: two threads begin with the same file. */
      work[i] = (work_t){.first = i/2, .n_open = (atoi(argv[1]) + n_thread - 1)/n_thread,
                         .n_deck = argc - 2, .deck = argv + 2};
      if (pthread_create(&thread[i], NULL, open_decks, &work[i]) != 0) return 3;
   }
   for (int i = 0; i < n_thread; ++i) {
      pthread_join(thread[i], NULL);
      n_refused += work[i].n_refused;
   }
   printf("%d\n", n_refused);
   return 0;
}
