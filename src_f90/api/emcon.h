/* EMCON: energy-momentum conserving contact dynamics. The interface for C (C99) and C++.
 *
 * A model is a deck that was read, at some point of its analysis. All state is in the model: any
 * number of them live side by side, each used from one thread at a time. No function stops the
 * program or prints; those that can fail return EMCON_OK or a code, and the text of the failure
 * stays with the model until the next one.
 *
 * Arrays belong to the caller. Those of nodes hold x and y of node 0, x and y of node 1 and so on;
 * their order is that of the deck, as emcon_get_labels tells. Units are those of the deck.
 */
#ifndef EMCON_H
#define EMCON_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Numbers follow semantic versioning: a program runs with every library of its major version (of
 * its minor version as long as the major one is 0) that is not older than the header it saw. */
#define EMCON_VERSION_MAJOR 0
#define EMCON_VERSION_MINOR 1
#define EMCON_VERSION_PATCH 0

/* What functions return; the same numbers as the exit codes of the program. */
enum {
   EMCON_OK = 0,
   EMCON_ERROR_INPUT = 2,      /* a deck or an argument is wrong */
   EMCON_ERROR_ANALYSIS = 3,   /* the analysis failed; the state is that of the last part before */
   EMCON_ERROR_FILE = 4,
   EMCON_ERROR_INTERNAL = 5,   /* a bug of the library */
   EMCON_ERROR_INTERRUPT = 130 /* a callback asked to stop; the model stays usable */
};

typedef struct emcon_model emcon_model;

typedef struct emcon_sizes {
   int n_node;
   int n_element;
   int n_contact;   /* contacts possible: slave nodes over all pairs */
   int n_pair;      /* contact pairs */
   int n_body;      /* connected meshes */
   int n_unknown;   /* in the present step of the deck */
   int n_step;      /* steps of the deck */
} emcon_sizes;

typedef struct emcon_increment {
   double h;
   double time;     /* at the end of the increment */
   int n_newton;    /* iterations, over all cuts and active sets */
   int n_cut;
   int n_active;    /* contacts */
} emcon_increment;

typedef struct emcon_ledger {
   double kinetic;
   double strain;
   double external_work;
   double contact_work;
   double total;    /* kinetic + strain - external_work */
   double px, py;   /* momentum */
   double lz;       /* angular momentum about the origin */
} emcon_ledger;

/* A sparse matrix by rows, numbers from 0: row i has the entries row_start[i] to row_start[i + 1] - 1
 * of `column` and `value`, the columns of a row in ascending order. The arrays belong to the model. */
typedef struct emcon_csr {
   int n_row;
   int n_column;
   const int *row_start;   /* n_row + 1 */
   const int *column;      /* row_start[n_row] */
   const double *value;    /* row_start[n_row] */
} emcon_csr;

/* Called after each increment; anything but 0 stops the run. */
typedef int (*emcon_progress)(void *user, const emcon_increment *increment, double fraction_done);

/* Called with each line that the program would write to its log. */
typedef void (*emcon_log)(void *user, const char *line);

/* The version of the library, which may be newer than the header. */
void emcon_version(int *major, int *minor, int *patch);

/* Read a deck and build its model. `parameters`: NAME=VALUE lines with line ends between them, or
 * NULL. `*model` has to be closed also after a failure, when it holds the messages of the deck. */
int emcon_open(const char *deck, const char *parameters, int is_lenient, emcon_model **model);

/* Free a model; harmless for NULL. */
void emcon_close(emcon_model *model);

/* The text of the last failure, "" if there was none; valid until the next call with the model. */
const char *emcon_message(emcon_model *model);

int emcon_get_sizes(emcon_model *model, emcon_sizes *sizes);

/* One increment on the grid of the deck; `increment` may be NULL. An error after the last one. */
int emcon_advance(emcon_model *model, emcon_increment *increment);

/* 1 after the last increment of the last step, else 0; also for NULL. */
int emcon_is_done(emcon_model *model);

/* Increments until `time` is reached, or the end of the deck. Callbacks may be NULL. */
int emcon_run(emcon_model *model, double time, emcon_progress progress, emcon_log log, void *user);

int emcon_get_time(emcon_model *model, double *time);
int emcon_get_ledger(emcon_model *model, emcon_ledger *ledger);

/* Labels of the nodes, n_node. */
int emcon_get_labels(emcon_model *model, int n_node, int *label);

/* Reference positions, displacements, velocities: 2*n_node each; NULL is left out. */
int emcon_get_positions(emcon_model *model, int n_node, double *x);
int emcon_get_state(emcon_model *model, int n_node, double *u, double *v);

/* Of each possible contact: multiplier (force), whether it acts, label of its slave node, number of
 * its pair from 0; NULL is left out. */
int emcon_get_contact(emcon_model *model, int n_contact, double *lam, int *is_active, int *label,
                      int *pair);

#ifdef __cplusplus
}
#endif

#endif
