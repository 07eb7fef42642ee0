/* EMCON: contact and ties for a host code that has its own solids, for C (C99) and C++.
 *
 * The host gives nodes, surfaces as lists of edges, contact pairs and ties, once; in each step it
 * gives displacements and gets gaps, discrete gradients, their derivatives, the next active set.
 * Elements, time stepping and equation solver are the host's. A complete one stands in
 * tests/embed/interface_bars.c; the notation is that of docs/theory.md, sections 4 and 5.
 *
 * Numbers count from 0: nodes, surfaces, pairs, ties, contacts, rows and columns. Coordinate a of
 * node i is freedom 2*i + a. Fields over the nodes hold x and y of node 0, x and y of node 1 and so
 * on, 2*n_node numbers. Lengths, masses and times are in any consistent units, [L] [M] [T]; the
 * plane has thickness 1.
 *
 * Sparse matrices are the emcon_csr of emcon.h. Their arrays, as those of
 * emcon_interface_constraints, are memory of the interface: they may be read until the function
 * that gave them is called again with it, or it is freed. An empty matrix may have NULL in place of
 * arrays.
 *
 * All state is in the interface: any number of them live side by side, each used from one thread at
 * a time. No function stops the program or prints. Those that return an int return EMCON_OK or a
 * code of emcon.h, and the text of the failure stays with the interface until the next one; what a
 * failed function should have written is undefined, unless it says more. An interface that is NULL
 * is EMCON_ERROR_INPUT, without a text. Arguments that are written to may be NULL: they are left
 * out.
 */
#ifndef EMCON_INTERFACE_H
#define EMCON_INTERFACE_H

#include "emcon.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct emcon_interface emcon_interface;

/* ---- to build an interface ------------------------------------------------------------------- */

enum { EMCON_NODE_TO_SEGMENT = 1, EMCON_SEGMENT = 2, EMCON_MORTAR = 3 };     /* formulation */
enum { EMCON_SEGMENTS = 1, EMCON_ELEMENTS = 2 };                            /* integration */
enum { EMCON_STANDARD = 1, EMCON_DUAL = 2 };                                /* multiplier */
enum { EMCON_EDGE_NORMAL = 1, EMCON_NODAL_NORMAL = 2 };                     /* normal */
enum { EMCON_UNSMOOTHED = 1, EMCON_HERMITE = 2 };                           /* smoothing */
enum { EMCON_PERSISTENT = 1, EMCON_ADMISSIBLE = 2 };                        /* initiation */

/* How a pair is computed; 0 is the default, so that `emcon_pair_options options = {0}` is all that
 * is needed before one of them is set. */
typedef struct emcon_pair_options {
   int integration;         /* of mortar contact; default EMCON_SEGMENTS, exactly by segments */
   int n_point;             /* Gauss points, 2..10 on segments, 1..10 on elements */
   int multiplier;          /* of mortar contact; default EMCON_DUAL */
   int normal;              /* of slave nodes; default EMCON_NODAL_NORMAL, the mean of the edges' */
   int smoothing;           /* of the master surface; default EMCON_UNSMOOTHED */
   double normal_angle;     /* sharper turns are corners, 0..180 degrees; default 60 */
   double smoothing_angle;  /* the same for smoothing */
} emcon_pair_options;

/* 0 is the default of all settings. */
typedef struct emcon_interface_settings {
   int initiation;          /* EMCON_PERSISTENT, the default: a new contact holds the gap that the
                               step began with, which keeps energy; EMCON_ADMISSIBLE closes it */
   double gap_tolerance;    /* no contact begins with a larger gap per edge; 0: any */
   int is_last_try;         /* 1: the host cannot try the step again in smaller parts */
   int is_end;              /* 1: statics: gradients at the end of the step, closed gaps; to be set
                               before emcon_interface_prepare, too */
} emcon_interface_settings;

typedef struct emcon_interface_sizes {
   int n_node;
   int n_surface;
   int n_pair;
   int n_tie;
   int n_contact;           /* contacts possible: slave nodes over all pairs */
   int n_unknown;           /* freedoms neither held nor tied to others */
   int n_selected;          /* contacts selected last */
} emcon_interface_sizes;

/* An interface of nodes at the reference positions `x`, 2*n_node [L]. `*face` is to be freed also
 * after a failure, when it holds the message. */
int emcon_interface_new(int n_node, const double *x /* n_node x 2 */, emcon_interface **face);

/* Free an interface; harmless for NULL. */
void emcon_interface_free(emcon_interface *face);

/* The text of the last failure, "" if there was none, NULL without an interface. And remarks on the
 * ties since emcon_interface_prepare, one per line. Each is valid until the next call of these two
 * functions with the interface. */
const char *emcon_interface_message(emcon_interface *face);
const char *emcon_interface_notes(emcon_interface *face);

/* Add a surface: first and last node of each edge, 2*n_edge numbers, the body to the left, so that
 * the outward normal is the edge turned by -90 degrees. Edges in any order, connected or in parts,
 * open or closed. `name` is for messages, NULL: its number. `*surface` is its number. */
int emcon_interface_add_surface(emcon_interface *face, const char *name, int n_edge,
                                const int *edge /* n_edge x 2 */, int *surface);

/* Add a contact pair; a surface in contact with itself is its own master. `options` NULL: the
 * defaults. Rigid obstacles are masters of held nodes. */
int emcon_interface_add_pair(emcon_interface *face, int slave, int master, int formulation,
                             const emcon_pair_options *options);

/* Tie two surfaces that meet, whatever their meshes. `multiplier`: EMCON_STANDARD or EMCON_DUAL;
 * `tolerance`: how far apart they may be [L], < 0: a tenth of an edge. */
int emcon_interface_add_tie(emcon_interface *face, int slave, int master, int multiplier,
                            double tolerance);

/* Settings, also between steps. */
int emcon_interface_set(emcon_interface *face, const emcon_interface_settings *settings);

/* Finish: from here on there are steps. `held`: 1 for freedoms that the host moves by itself,
 * 2*n_node, NULL: none. Slave nodes of ties are moved onto their masters: the host takes over
 * emcon_interface_get_positions. After a failure it may be called again. */
int emcon_interface_prepare(emcon_interface *face, const int *held /* n_node x 2, or NULL */);

int emcon_interface_get_sizes(emcon_interface *face, emcon_interface_sizes *sizes);

/* Positions `x`, 2*n_node [L], and how far a slave node was moved onto its master at most [L]. */
int emcon_interface_get_positions(emcon_interface *face, double *x /* n_node x 2 */,
                                  double *largest_move);

/* Slave node and pair of each possible contact, n_contact each. */
int emcon_interface_get_contacts(emcon_interface *face, int n_contact, int *node /* n_contact */,
                                 int *pair /* n_contact */);

/* ---- ties and held freedoms ------------------------------------------------------------------ */

/* D and M of a tie, over nodes, one row for each multiplier: D x = M x in both directions [L]. */
int emcon_interface_get_tie_matrices(emcon_interface *face, int tie, emcon_csr *d, emcon_csr *m);

/* T (2*n_node x n_unknown) of u = T w with the unknowns w: a residual becomes T^T r, a tangent
 * T^T K T. Rows of held freedoms are empty. */
int emcon_interface_get_links(emcon_interface *face, emcon_csr *t);

/* Tied freedoms of a displacement or velocity follow the others; forces on tied freedoms go to
 * those that they follow. `field`: 2*n_node, changed in place, unchanged after a failure. */
int emcon_interface_follow(emcon_interface *face, double *field /* n_node x 2, in and out */);
int emcon_interface_gather(emcon_interface *face, double *field /* n_node x 2, in and out */);

/* ---- a step from the displacements u0 by du, 2*n_node each [L] ------------------------------- */

/* Where a possible contact stands at both ends of the step. */
typedef struct emcon_gap {
   int is_near;             /* 0: there is no surface within reach, and no gap */
   int is_over;             /* over the surface, not past its end */
   double gap_start;        /* > 0 open [L]; of mortar contact a weighted mean */
   double gap_end;
   double edge;             /* length of an edge, to which tolerances relate [L] */
} emcon_gap;

/* The selected contacts over a step. Contact k holds its gap at target[k]: f_k, their difference
 * times the part of the surface that is covered, has to be 0. Its force on the nodes is lam[k]
 * times row k of g; Newton's method linearises f_k by row k of c. In statics (is_end) gap_start is
 * that of the end, gap_change is 0, and c is g. */
typedef struct emcon_interface_constraints {
   int n;
   const int *contact;         /* n numbers of contacts, ascending */
   const double *target;       /* n [L] */
   const double *gap_start;    /* n, f at the start [L] */
   const double *gap_end;      /* n, f at the end */
   const double *gap_change;   /* n, row k of g times du, to relative accuracy */
   const double *defect;       /* n, is to be 0: gap_change where the gap is held, else gap_end */
   const double *edge;         /* n, length of an edge, to which defects relate [L] */
   emcon_csr g;                /* n x 2*n_node, discrete gradients */
   emcon_csr c;                /* n x 2*n_node, gradients at the end; the pattern of g */
} emcon_interface_constraints;

/* How an active set ended. */
enum {
   EMCON_STEP_DONE = 0,
   EMCON_STEP_CYCLING = 5,     /* the sets repeat: try a smaller step */
   EMCON_STEP_TOO_FAR = 6,     /* the motion leaves what contact was chosen for: a smaller step */
   EMCON_STEP_STANDS_OFF = 7   /* a contact would begin farther away than gap_tolerance: smaller */
};

/* Begin a step with the motion that is expected. Flags of n_contact contacts: which acted at the
 * end of the step before, and which of them still can. One array may be given for both. */
int emcon_interface_begin_step(emcon_interface *face, const double *u0 /* n_node x 2 */,
                               const double *du /* n_node x 2 */, int n_contact,
                               const int *was_active /* n_contact */,
                               int *active /* n_contact */);

/* All gaps, n_contact. */
int emcon_interface_get_gaps(emcon_interface *face, const double *u0 /* n_node x 2 */,
                             const double *du /* n_node x 2 */, int n_contact,
                             emcon_gap *gap /* n_contact */);

/* Select the contacts that act, by flags; `*n` becomes their number. */
int emcon_interface_select(emcon_interface *face, const double *u0 /* n_node x 2 */,
                           const double *du /* n_node x 2 */, int n_contact,
                           const int *active /* n_contact */, int *n);

/* Select `n` contacts by their numbers, ascending, with gaps to hold of the host's own choice [L].
 * emcon_interface_update_active does not go with these. */
int emcon_interface_choose(emcon_interface *face, const double *u0 /* n_node x 2 */,
                           const double *du /* n_node x 2 */, int n,
                           const int *contact /* n */, const double *target /* n */);

/* Values and gradients of the selected contacts. */
int emcon_interface_evaluate(emcon_interface *face, const double *u0 /* n_node x 2 */,
                             const double *du /* n_node x 2 */,
                             emcon_interface_constraints *constraints);

/* sum of lam[k] d g_k/d u1 (2*n_node x 2*n_node) as last evaluated, which the tangent of the step
 * gets with a minus sign; and the same times a direction, 2*n_node each. `lam`: n multipliers of
 * the selected contacts, forces, > 0 pressing [M L/T^2]. */
int emcon_interface_get_curvature(emcon_interface *face, int n, const double *lam /* n */,
                                  emcon_csr *matrix);
int emcon_interface_second_times(emcon_interface *face, int n, const double *lam /* n */,
                                 const double *direction /* n_node x 2 */,
                                 double *product /* n_node x 2 */);

/* The next active set from a solved step: takes in what would penetrate, releases what pulls.
 * `active`, flags of n_contact contacts: those selected, then the next ones. `*is_done`: the set
 * stands, or `*outcome` is not EMCON_STEP_DONE and the step cannot be ended. `magnitude`, 2*n_node:
 * sums of the sizes of the contributions to the residual, which tell signs of round-off from
 * tension; NULL: the contact forces themselves. */
int emcon_interface_update_active(emcon_interface *face, const double *u0 /* n_node x 2 */,
                                  const double *du /* n_node x 2 */, int n,
                                  const double *lam /* n */,
                                  const double *magnitude /* n_node x 2, or NULL */,
                                  int n_contact, int *active /* n_contact, in and out */,
                                  int *is_done, int *outcome);

/* Areas that the multipliers of the step to `u1` act on, n_contact each [L^2], so that the pressure
 * is lam/area, and lengths of slave surface that belong to them at its end [L]. */
int emcon_interface_get_areas(emcon_interface *face, const double *u1 /* n_node x 2 */,
                              int n_contact, double *area /* n_contact */,
                              double *length /* n_contact */);

/* ---- without multipliers --------------------------------------------------------------------- */

/* P and DF (n_unknown x n_unknown - n) for the constraints as last evaluated: P^T T^T g^T = 0 and
 * c T DF = 0. If selected contacts follow from others, `redundant` are the `*n_redundant` places of
 * them in the selection, to be given to emcon_interface_drop, and the matrices are empty.
 * EMCON_ERROR_ANALYSIS: there are no good unknowns to eliminate; solve with multipliers. */
int emcon_interface_get_null_space(emcon_interface *face, emcon_csr *p, emcon_csr *df,
                                   int *n_redundant, const int **redundant);

/* Leave selected contacts out for the rest of the step; `active`, n_contact: what is left. */
int emcon_interface_drop(emcon_interface *face, int n_redundant,
                         const int *redundant /* n_redundant */, int n_contact,
                         int *active /* n_contact */);

/* After emcon_interface_get_null_space: n multipliers from the residual T^T r without contact
 * forces, n_unknown numbers. */
int emcon_interface_multipliers(emcon_interface *face, int n_unknown,
                                const double *residual /* n_unknown */, int n,
                                double *lam /* n */);

/* After emcon_interface_get_null_space: the motion `dw`, n_unknown, of dependent unknowns alone
 * that closes the `defect`, n. Newton's step is this plus DF times that of the others. */
int emcon_interface_particular(emcon_interface *face, int n, const double *defect /* n */,
                               int n_unknown, double *dw /* n_unknown */);

#ifdef __cplusplus
}
#endif

#endif
