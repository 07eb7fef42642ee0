/* EMCON: energy-momentum conserving contact dynamics. The interface for C (C99) and C++.
 *
 * A model is a deck that was read, at some point of its analysis; or nodes, surfaces, contact pairs
 * and ties of a host code, which has solids and time steps of its own. All state is in the model:
 * any number of them live side by side, each used from one thread at a time. No function stops the
 * program or prints; those that can fail return EMCON_OK or a code, and the text of the failure
 * stays with the model until the next one. A call that fails leaves the model as it was, unless
 * the text here says otherwise. A model that was closed must not be used again: that cannot be
 * checked.
 *
 * Arrays belong to the caller, who says how long they are. Those of nodes hold x, y and in
 * space z of node 0, then those of node 1 and so on, n_dim*n_node numbers; their order is that of
 * the deck, as emcon_get_labels tells. Whether n_dim is 2 or 3 depends on the deck: emcon_get_sizes
 * tells it as soon as the deck is read, and who takes any deck has to ask. An output that is NULL
 * is left out. Inputs that may be NULL are named. Labels and degrees of freedom (1 to n_dim) are
 * those of the deck; all else is counted from 0, but in messages from 1. Units are those of the
 * deck.
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
#define EMCON_VERSION_MINOR 5
#define EMCON_VERSION_PATCH 0

/* What functions return; the same numbers as the exit codes of the program. */
enum {
   EMCON_OK = 0,
   EMCON_ERROR_INPUT = 2,      /* a deck or an argument is wrong */
   EMCON_ERROR_ANALYSIS = 3,   /* the analysis failed */
   EMCON_ERROR_FILE = 4,
   EMCON_ERROR_INTERNAL = 5,   /* a bug of the library */
   EMCON_ERROR_INTERRUPT = 130 /* a callback asked to stop; the model stays usable */
};

/* What a code means, in a few words that stay where they are; what was wrong this time is told by
 * emcon_message. */
const char *emcon_status_text(int status);

/* Kinds of loads. */
enum {
   EMCON_LOAD_POINT = 1,       /* force on a degree of freedom of a node */
   EMCON_LOAD_PRESSURE = 2,    /* on a face of an element */
   EMCON_LOAD_GRAVITY = 3      /* acceleration of an element */
};

typedef struct emcon_model emcon_model;
typedef struct emcon_snapshot emcon_snapshot;

typedef struct emcon_sizes {
   int n_node;
   int n_element;
   int n_contact;    /* contacts possible: slave nodes over all pairs, then those of guards */
   int n_pair;       /* contact pairs; one that holds both sides is two, its reverse behind it */
   int n_body;       /* connected meshes */
   int n_unknown;    /* in the present step of the deck */
   int n_step;       /* steps of the deck */
   int n_constraint; /* all constraints: rows of ties and equations, then the n_contact contacts */
   int n_load;       /* in the present step of the deck */
   int i_step;       /* the present step of the deck; the first is 1, as in messages */
   int n_surface;
   int n_tie;
   int n_selected;   /* rows of constraints that were selected or evaluated last */
   int n_dim;        /* 2: in the plane; 3: in space */
   int n_slip;       /* components of slips along surfaces: n_dim - 1 */
   int n_momentum;   /* momenta of a body: n_dim linear ones, then 1 angular one, in space 3 */
   int n_pair_total; /* figures of a contact pair: 2*n_momentum + 1 */
} emcon_sizes;

typedef struct emcon_increment {
   double h;
   double time;      /* at the end of the increment */
   int n_newton;     /* iterations, over all cuts and active sets */
   int n_cut;
   int n_active;     /* contacts */
   double penetration;  /* the deepest that geometry found at its end, per edge */
} emcon_increment;

typedef struct emcon_ledger {
   double kinetic;
   double strain;
   double potential; /* of forces that are given from outside by their energy */
   double external_work;
   double contact_work;
   double total;     /* kinetic + strain + potential + contact_energy - external_work */
   double px, py;    /* momentum; pz, lx and ly stand at the end */
   double lz;        /* angular momentum about the origin */
   double stabilization;   /* work of what *CONTACT CONTROLS, STABILIZE bears: round-off */
   double restitution_loss;   /* of contact work: what impacts took by RESTITUTION, >= 0 */
   double scheme_loss;        /* what the damping of the scheme took, >= 0 */
   double damping_loss;       /* what *DAMPING of materials took, >= 0 */
   double contact_energy;     /* what contact by penalty stores, >= 0 */
   double friction_loss;      /* what friction took, >= 0 */
   double pz, lx, ly;         /* 0 in the plane */
   double contact_damping_loss;   /* what *CONTACT DAMPING took, >= 0 */
} emcon_ledger;

/* A sparse matrix by rows: row i has the entries row_start[i] to row_start[i + 1] - 1 of `column`
 * and `value`, the columns of a row in ascending order. The arrays belong to the model; they are
 * valid until the function that gave them is called again, or the model is closed. */
typedef struct emcon_csr {
   int n_row;
   int n_column;
   const int *row_start;   /* n_row + 1 */
   const int *column;      /* row_start[n_row] */
   const double *value;    /* row_start[n_row] */
} emcon_csr;

/* Constraints over a step, ascending by their numbers. Number k holds its gap at target[k]: f_k,
 * their difference times the part of the surface that is covered, has to be 0. Its force on the
 * nodes is its multiplier times row k of `discrete_gradient`; Newton's method linearises f_k by row
 * k of `end_gradient`. In statics gap0 is that of the end, dgap is 0, and the gradients are one.
 * With friction a contact that sticks has rows of its slips, too, behind the gaps of all: f_k is
 * target[k] less the slip, the multiplier is friction. One that slides has its friction in the
 * `discrete_gradient` of its gap, so that it is mu times the multiplier.
 * The arrays belong to the model, as those of a matrix. */
typedef struct emcon_constraint_report {
   int n;
   const int *id;                 /* number among the n_constraint constraints */
   const int *pair;               /* number of the contact pair; -1: of a tie or an equation */
   const int *node;               /* number of the slave node; -1 likewise */
   const double *target;          /* > 0 is open; of mortar contact a weighted mean */
   const double *gap0;            /* f at the start */
   const double *gap1;            /* f at the end */
   const double *dgap;            /* gap1 - gap0, to relative accuracy */
   const double *defect;          /* is to be 0: dgap where the gap of the start is held, or gap1 */
   const double *size;            /* length of an edge, to which defects relate */
   emcon_csr discrete_gradient;   /* n x n_dim*n_node, times the motion it is dgap */
   emcon_csr end_gradient;        /* n x n_dim*n_node, the gradient at the end */
   const int *slip;               /* 0: a row of a gap; else of which slip, from 1 */
} emcon_constraint_report;

/* Where a possible contact stands at both ends of a step. */
typedef struct emcon_gap {
   int is_near;             /* 0: there is no surface within reach, and no gap */
   int is_over;             /* over the surface, not past its end */
   double gap0;             /* > 0 is open; of mortar contact a weighted mean */
   double gap1;
   double size;             /* length of an edge, to which tolerances relate */
} emcon_gap;

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
   double friction;         /* coefficient of Coulomb's law, >= 0 */
   double adjust;           /* slave nodes no farther from the master than this, and those behind it,
                               are moved onto it by emcon_build: the host takes over
                               emcon_get_positions; 0: none */
   double damping;          /* pressure by the velocity of approach, >= 0 */
   double damping_clearance;   /* gap from which on there is none, >= 0 */
   double damping_flat;     /* part of the clearance where damping is the whole, 0 to 1 */
   double tangent_fraction; /* part of it against slip, >= 0 */
} emcon_pair_options;

/* How contact begins in the steps of a host; 0 is the default. */
typedef struct emcon_contact_settings {
   int initiation;          /* EMCON_PERSISTENT, the default: a new contact holds the gap that the
                               step began with, which keeps energy; EMCON_ADMISSIBLE closes it */
   double gap_tolerance;    /* no contact begins with a larger gap per edge; 0: any */
   int is_last_try;         /* 1: the host cannot try the step again in smaller parts */
   int is_end;              /* 1: statics: gradients at the end of the step, closed gaps; to be set
                               before emcon_build, too */
} emcon_contact_settings;

/* How an active set ended. */
enum {
   EMCON_STEP_DONE = 0,
   EMCON_STEP_CYCLING = 5,     /* the sets repeat: try a smaller step */
   EMCON_STEP_TOO_FAR = 6,     /* the motion leaves what contact was chosen for: a smaller step */
   EMCON_STEP_STANDS_OFF = 7   /* a contact would begin farther away than gap_tolerance: smaller */
};

/* Called after each increment; anything but 0 stops the run. */
typedef int (*emcon_progress)(void *user, const emcon_increment *increment, double fraction_done);

/* Called with each line that the program would write to its log. */
typedef void (*emcon_log)(void *user, const char *line);

/* The version of the library, which may be newer than the header. */
void emcon_version(int *major, int *minor, int *patch);

/* ---- reading and building -------------------------------------------------------------------- */

/* Read a deck, without building its model. `parameters`: NAME=VALUE lines with line ends between
 * them, or NULL. `is_lenient`: unknown keywords are no errors. `*model` has to be closed also after
 * a failure, when it holds the messages of the deck; nothing else can be done with it then. */
int emcon_read(const char *deck, const char *parameters /* or NULL */, int is_lenient,
               emcon_model **model);

/* The same for a deck in memory. `name` stands for the file in messages; what the deck includes is
 * looked for beside it. */
int emcon_read_text(const char *text, const char *name, const char *parameters /* or NULL */,
                    int is_lenient, emcon_model **model);

/* The same for a text whose lines stand in several files. A passage is four numbers: how many lines
 * it has; which of the files `names`, one per line, it stands in, from 1; at which line there; and
 * 1 if its lines are counted on from that one, 0 if all are told as that one. */
int emcon_read_passages(const char *text, int n_passage, const int *passage /* n_passage x 4 */,
                        const char *names, const char *parameters /* or NULL */,
                        int is_lenient, emcon_model **model);

/* Build the model of the deck that was read, and begin its first step. After a failure the model
 * can only be closed. */
int emcon_build(emcon_model *model);

/* Read a deck and build its model. */
int emcon_open(const char *deck, const char *parameters /* or NULL */, int is_lenient,
               emcon_model **model);

/* Free a model, and all that it has given; harmless for NULL. Snapshots stay. */
void emcon_close(emcon_model *model);

/* The text of the last failure, "" if there was none, NULL for NULL; valid until the next call
 * with the model. */
const char *emcon_message(emcon_model *model);

/* ---- what is given between reading and building ---------------------------------------------- */

/* A model can be given what a deck cannot say: laws, potentials, and the solid of a host code. The
 * functions are called whenever the model is stepped or queried, in the thread that does so, and
 * must live as long as the model. They return 0; 1 for a state at which there is no energy, as in
 * an inverted element: the step is tried again in smaller parts; or anything else to make the call
 * of the library fail. A function must not call the library with the model that calls it. */

/* An energy at n_point points z of n_variable variables each, z[n_variable*point + variable]:
 * `value` (n_point), `gradient` (n_point x n_variable), and unless it is NULL `hessian` (n_point x
 * n_variable x n_variable). The library makes a discrete gradient of it, which keeps the energy. */
typedef int (*emcon_point_function)(void *user, int n_point, int n_variable, const double *z,
                                    int wants_hessian, double *value, double *gradient,
                                    double *hessian);

/* Forces of a step from displacements `u0` by `du`, both n_dim*n_node: `force` (n_dim*n_node), the
 * energy at the end, and unless it is NULL `tangent`, the derivative of the forces by u0 + du, in
 * the slots of the pattern that was given. The energy is kept if force . du is its change. For du =
 * 0 the forces are the gradient of the energy, and the tangent of a discrete gradient is half its
 * second derivative. `magnitude` (n_dim*n_node), sums of |contributions| to the forces, tells what
 * of them is round-off; left at 0, it is taken as |force|. */
typedef int (*emcon_force_function)(void *user, int n_node, const double *u0, const double *du,
                                    int wants_tangent, double *force, double *magnitude,
                                    double *energy, double *tangent);

/* The strain energy per reference volume of the *USER MATERIAL `name`, a function of the strains
 * E11, E22, 2*E12; in three dimensions E11, E22, E33, 2*E12, 2*E23, 2*E13. */
int emcon_give_law(emcon_model *model, const char *name, emcon_point_function law, void *user);

/* A potential of the present position of each of n nodes, counted from 0. `name` is for
 * messages. The variables are its n_dim coordinates. */
int emcon_give_potential(emcon_model *model, const char *name /* or NULL */, int n,
                         const int *node /* n */, emcon_point_function potential, void *user);

/* Forces between nodes: `pattern` (n_dim*n_node x n_dim*n_node, its values are not looked at) tells
 * which depend on which. Nodes of no element are part of the model where they stand in it. */
int emcon_give_force(emcon_model *model, const char *name /* or NULL */, const emcon_csr *pattern,
                     emcon_force_function force, void *user);

/* A mass beside that of the elements, n_node x n_node, the same in all directions. */
int emcon_give_mass(emcon_model *model, const emcon_csr *mass);

/* ---- a model of a host code ------------------------------------------------------------------ */

/* In place of reading a deck: nodes, then surfaces, pairs and ties, then emcon_build. Steps are the
 * host's: see "contact over a step". Labels are the numbers of nodes, from 1. Complete hosts stand
 * in tests/embed/interface_bars.c and tests/embed/interface_springs.py; the notation is that of
 * docs/theory.md, sections 4 and 5. Units are consistent ones; the plane has thickness 1. */

/* Nodes at the reference positions `x` in the plane, or in space, n_dim = 2 or 3; those that no
 * surface holds may be left out. `*model` has to be closed also after a failure. */
int emcon_new(int n_node, int n_dim, const double *x /* n_node x n_dim */, emcon_model **model);

/* Add a surface of the plane: first and last node of each edge, 2*n_edge numbers, the body to the
 * left, so that the outward normal is the edge turned by -90 degrees. Edges in any order, connected
 * or in parts, open or closed. `name` is for messages, NULL: its number. `*surface` is its number. */
int emcon_add_surface(emcon_model *model, const char *name /* or NULL */, int n_edge,
                      const int *edge /* n_edge x 2 */, int *surface);

/* Add a surface of faces whose kinds may differ, in any order, connected or in parts, open or
 * closed. `kind` as VTK numbers cells: in space triangles 5 and quadrilaterals 9, with a node in
 * the middle of each side 22 and 23; in the plane edges, 3. `offset`: entries of `node` up to and
 * with those of the face, as files of VTK have it. `node`: of all faces one after the other, in
 * each corners counter-clockwise as seen from outside the body, then the nodes between a corner
 * and the next. */
int emcon_add_faces(emcon_model *model, const char *name /* or NULL */, int n_face,
                    const int *kind /* n_face */, const int *offset /* n_face */, int n_entry,
                    const int *node /* n_entry */, int *surface);

/* Add a contact pair; a surface in contact with itself is its own master. `options` NULL: the
 * defaults. Rigid obstacles are masters of held nodes. In space EMCON_MORTAR, or
 * EMCON_NODE_TO_SEGMENT, the slaves' nodes held; a pair the other way round holds those of the
 * master, too. */
int emcon_add_pair(emcon_model *model, int slave, int master, int formulation,
                   const emcon_pair_options *options /* or NULL */);

/* Tie two surfaces that meet, whatever their meshes. `multiplier`: EMCON_STANDARD or EMCON_DUAL;
 * `tolerance`: how far apart they may be, < 0: a tenth of an edge. emcon_build moves slave nodes
 * onto their masters: the host takes over emcon_get_positions. */
int emcon_add_tie(emcon_model *model, int slave, int master, int multiplier, double tolerance);

/* Freedoms that the host moves by itself: 1, else 0. None, if this is not called. */
int emcon_hold(emcon_model *model, int n_node, const int *held /* n_node x n_dim */);

/* Settings, also between steps. */
int emcon_set_contact(emcon_model *model, const emcon_contact_settings *settings);

/* ---- the run of the deck --------------------------------------------------------------------- */

/* Let n threads work on the model from here on. Before, as many do as OMP_NUM_THREADS says, or one
 * if it is not set. Results are the same to the last bit for any number. */
int emcon_set_threads(emcon_model *model, int n);

/* One increment on the grid of the deck. An error after the last one. After a failed increment the
 * state is that of the last part before. */
int emcon_advance(emcon_model *model, emcon_increment *increment);

/* 1 after the last increment of the last step, else 0; 1 also for NULL. */
int emcon_is_done(emcon_model *model);

/* Increments until `time` is reached, or the end of the deck. Callbacks may be NULL. */
int emcon_run(emcon_model *model, double time, emcon_progress progress, emcon_log log, void *user);

/* Write results as a run of the program does, from the present state on: `base`.vtkhdf, .h5, .csv,
 * a row and what the deck asks for after each increment of whichever function, and `base`.log, with
 * what failed; until it is ended, which adds `base`.json, or the model is closed. Where they cannot
 * be written any more, the record ends and the increment tells so. */
int emcon_record(emcon_model *model, const char *base);
int emcon_end_record(emcon_model *model);

/* ---- steps of any size ----------------------------------------------------------------------- */

/* One step of the size h > 0 under the conditions of the present step of the deck, cut into parts
 * where it fails. It may end anywhere, also after the end of the deck's step: amplitudes and linear
 * runs keep their last value there. emcon_advance goes on from points of the deck's grid only. */
int emcon_step(emcon_model *model, double h, emcon_increment *increment);

/* Begin the next step of the deck at the present time, wherever that is. */
int emcon_next_step(emcon_model *model);

/* Put the given parts of the state in place of the present ones; each may be NULL, and a count is
 * looked at only where one of its arrays is given. Dependent nodes of ties and equations follow the
 * others; energies and momenta are measured anew, the works stand. `lam` is 0 where a constraint
 * does not act; `time` is not before the start of the present step of the deck. With `u` the forces
 * of the last step are forgotten. */
int emcon_set_state(emcon_model *model, int n_node, const double *u /* n_node x n_dim, or NULL */,
                    const double *v /* n_node x n_dim, or NULL */, int n_constraint,
                    const double *lam /* n_constraint, or NULL */,
                    const int *is_active /* n_constraint, or NULL */,
                    const double *time /* 1, or NULL */);

/* Keep the present state; `*snapshot` is NULL after a failure. It outlives the model. */
int emcon_take_snapshot(emcon_model *model, emcon_snapshot **snapshot);

/* Go back, or forward, to a state that was taken from this model: what follows has the same bits.
 * The step of the deck is that of the snapshot, with the loads and boundary values it has now. */
int emcon_restore_snapshot(emcon_model *model, const emcon_snapshot *snapshot);

/* Free a snapshot; harmless for NULL. */
void emcon_free_snapshot(emcon_snapshot *snapshot);

/* Write deck, state and conditions of the present step to a file; emcon_load makes a model of it
 * that goes on with the same bits. `*model` has to be closed also after a failure. Laws, potentials
 * and forces are not in the file: a model that was read and given them is built by emcon_resume, in
 * place of emcon_build, as the file holds it. */
int emcon_save(emcon_model *model, const char *path);
int emcon_load(const char *path, emcon_model **model);
int emcon_resume(emcon_model *model, const char *path);

/* ---- what a model holds ---------------------------------------------------------------------- */

/* Before emcon_build only n_node, n_element, n_step, n_dim, n_slip, n_momentum and n_pair_total are
 * known; the others are 0. */
int emcon_get_sizes(emcon_model *model, emcon_sizes *sizes);

int emcon_get_time(emcon_model *model, double *time);

/* How much of the run of the deck is done, 0 to 1, and the time at which its last step ends. */
int emcon_get_progress(emcon_model *model, double *fraction, double *t_end);

int emcon_get_ledger(emcon_model *model, emcon_ledger *ledger);

/* The verdict on the increments that led to this state, of whichever function: is the balance
 * closed, nothing behind a surface, every residual within the tolerance? `*json` is what a run of
 * the deck leaves in NAME.json, one line; it belongs to the model and is valid until this is asked
 * again, or the model is closed. A snapshot holds its verdict. */
int emcon_get_verdict(emcon_model *model, int *is_good, const char **json);

/* Remarks on the deck, and on what was done before the first step, one per line: `*text` as that of
 * emcon_get_verdict. */
int emcon_get_notes(emcon_model *model, const char **text);

/* What the scene consists of, what of the program it needs, sizes, advice: the report of `emcon
 * check --json` but for the cost, one JSON object: `*json` as that of emcon_get_verdict. */
int emcon_get_report(emcon_model *model, const char **json);

/* Which nodes are in the node set `name`: 1, else 0. */
int emcon_find_nodes(emcon_model *model, const char *name, int n_node, int *is_in /* n_node */);

/* The names that sets and surfaces have in the deck, a line each: `node set RING`, `element set
 * RING`, `surface RING_OUTER`. `*text` as that of emcon_get_verdict. */
int emcon_get_names(emcon_model *model, const char **text);

/* Which elements are in the element set `name`: 1, else 0; which of their faces in the surface
 * `name`, as the deck counts them: face 1 is the first. */
int emcon_find_elements(emcon_model *model, const char *name, int n_element,
                        int *is_in /* n_element */);
int emcon_find_faces(emcon_model *model, const char *name, int n_element,
                     int *is_in /* n_element x 6 */);

/* Elements: labels, what VTK calls their kind (5 and 9: CPE3 and CPE4, 10 and 12: C3D4 and C3D8),
 * and their nodes in VTK's order, which is that of the deck; -1 behind the last. */
int emcon_get_elements(emcon_model *model, int n_element, int *label /* n_element */,
                       int *kind /* n_element */, int *node /* n_element x 20 */);

/* The body that each node is part of, one of n_body; -1: of none. */
int emcon_get_bodies(emcon_model *model, int n_node, int *body /* n_node */);

/* Labels of the nodes, n_node. */
int emcon_get_labels(emcon_model *model, int n_node, int *label /* n_node */);

/* Reference positions. emcon_build may move nodes, to close a tie or an initial contact. */
int emcon_get_positions(emcon_model *model, int n_node, double *x /* n_node x n_dim */);

/* Displacements and velocities. */
int emcon_get_state(emcon_model *model, int n_node, double *u /* n_node x n_dim */,
                    double *v /* n_node x n_dim */);

/* Of each constraint: multiplier (force), and whether it acts. */
int emcon_get_multipliers(emcon_model *model, int n_constraint, double *lam /* n_constraint */,
                          int *is_active /* n_constraint */);

/* The same of each possible contact, the label of its slave node, and the number of its pair. */
int emcon_get_contact(emcon_model *model, int n_contact, double *lam /* n_contact */,
                      int *is_active /* n_contact */, int *label /* n_contact */,
                      int *pair /* n_contact */);

/* Pressure of each possible contact, 0 where open, and its gap, NaN where no surface is near: CSTR
 * and CDIS of the deck. */
int emcon_get_pressures(emcon_model *model, int n_contact, double *pressure /* n_contact */,
                        double *gap /* n_contact */);

/* Of each possible contact, 0 without *FRICTION: its traction against slip, 1 where it sticks and 2
 * where it slides, its slip along the surface so far, and the length of that way: CSHEAR and CSLIP
 * of the deck. Traction and slip are vectors along the surface, in the plane of one component. */
int emcon_get_friction(emcon_model *model, int n_contact, double *shear /* n_contact x n_slip */,
                       int *way /* n_contact */, double *slip /* n_contact x n_slip */,
                       double *path /* n_contact */);

/* Of each pair: the energy that friction has taken since the start, >= 0; of one that holds both
 * sides all of it, and 0 at its reverse. Their sum is `friction_loss` of the ledger. */
int emcon_get_pair_friction(emcon_model *model, int n_pair, double *loss /* n_pair */);

/* Of each pair: force and moment about the origin on the slave side, in the plane fx, fy, m, in
 * space fx, fy, fz, mx, my, mz; the same on the master side; length in contact, in space area; and
 * the number of active contacts. */
int emcon_get_pairs(emcon_model *model, int n_pair, double *total /* n_pair x n_pair_total */,
                    int *n_active /* n_pair */);

/* The field that the field file has of a variable of decks, as U, V, RF, S, E, ENER, CDIS, CSTR,
 * CF, in the present state: `*n_component` numbers for each of `*n_place` nodes, of E, ENER, ELKE
 * and EVOL elements; S are six components of Cauchy's stress and von Mises' behind them. The array
 * belongs to the model and is valid until this is asked again, or the model is closed. */
int emcon_get_field(emcon_model *model, const char *name, int *n_place, int *n_component,
                    const double **value);

/* Of each body: momentum, and angular momentum about the origin; in the plane px, py, lz, in space
 * px, py, pz, lx, ly, lz. */
int emcon_get_momenta(emcon_model *model, int n_body, double *momenta /* n_body x n_momentum */);

/* ---- loads and boundary values --------------------------------------------------------------- */

/* Changes hold for the present step of the deck. With an amplitude a value is what the amplitude is
 * multiplied by. Without one, the linear runs of a static step go on from where they are to the new
 * value at the end of the step; in a dynamic step it holds from the next step on. */

/* Number of the load of this kind on node or element `label`; `place` is the degree of freedom of a
 * force, the face of a pressure, and not looked at for gravity. Of several the first. */
int emcon_find_load(emcon_model *model, int kind, int label, int place, int *load);

/* Give load 0 <= `load` < n_load of the present step a value. */
int emcon_set_load(emcon_model *model, int load, double value);

/* Add `n` loads of one kind, where the present step has none of it: places as above, gravity along
 * `direction`, of any length. In a static step they run from 0 to their values at its end. All are
 * added, or none. */
int emcon_add_loads(emcon_model *model, int kind, int n, const int *label /* n */,
                    const int *place /* n */, const double *value /* n */,
                    const double *direction /* 3, or NULL */);

/* Give the boundary condition on degree of freedom `dof` of node `label` a value; prescribe a free
 * one; the one or the other, as it is; set one free. Where the unknowns become more or less they
 * are numbered anew, and the state stays. */
int emcon_set_prescribed(emcon_model *model, int label, int dof, double value);
int emcon_add_prescribed(emcon_model *model, int label, int dof, double value);
int emcon_prescribe(emcon_model *model, int label, int dof, double value);
int emcon_remove_prescribed(emcon_model *model, int label, int dof);

/* ---- what the engine computes for a step ----------------------------------------------------- */

/* Queries change neither the state nor what later steps give, to the last bit. The displacements of
 * all nodes are T times the unknowns, up to prescribed motion. */

/* Number of the unknown of each degree of freedom, n_dim*n_node; -1: prescribed, dependent, or of
 * no element. */
int emcon_unknowns(emcon_model *model, int n_node, int *unknown /* n_node x n_dim */);

/* T, n_dim*n_node x n_unknown: row n_dim*node + direction. */
int emcon_links(emcon_model *model, emcon_csr *matrix);

/* Dependent freedoms of a displacement or velocity follow the others; forces on dependent freedoms
 * go to those that they follow. `field` is changed in place, unchanged after a failure. */
int emcon_follow(emcon_model *model, int n_node, double *field /* n_node x n_dim, in and out */);
int emcon_gather(emcon_model *model, int n_node, double *field /* n_node x n_dim, in and out */);

/* D and M of a tie, over nodes, one row for each multiplier: D x = M x in each direction. */
int emcon_get_tie_matrices(emcon_model *model, int tie, emcon_csr *d, emcon_csr *m);

/* The consistent mass, n_node x n_node, the same in all directions. */
int emcon_mass(emcon_model *model, emcon_csr *matrix);

/* Where a step of the size h from the present state would start its iteration. */
int emcon_guess(emcon_model *model, double h, int n_node, double *u1 /* n_node x n_dim */);

/* Evaluate the step of the size h from the present state to displacements `u1`: what the functions
 * below give belongs to the last evaluation. Constraints that act are those of the state, or
 * `is_active` unless it is NULL, less those that have no surface near; their multipliers those of
 * the state, or `lam` unless it is NULL. */
int emcon_evaluate(emcon_model *model, double h, int n_node, const double *u1 /* n_node x n_dim */,
                   int with_tangent, int n_constraint,
                   const double *lam /* n_constraint, or NULL */,
                   const int *is_active /* n_constraint, or NULL */);

/* Residual: inertia, internal forces less loads, and `with_contact` less those of the constraints.
 * At the nodes, where it is the reaction on prescribed freedoms; and T^T times it. */
int emcon_residual(emcon_model *model, int with_contact, int n_node,
                   double *nodal /* n_node x n_dim */, int n_unknown,
                   double *unknown /* n_unknown */);

/* Derivative of the residual by the unknowns at the end of the step, n_unknown x n_unknown, for
 * fixed multipliers; `with_contact` with the second derivatives of the gaps. The evaluation has to
 * be one with tangent. */
int emcon_tangent(emcon_model *model, int with_contact, emcon_csr *matrix);

/* Null-space matrix P, and DF of the reparametrisation, for the constraints that act in the last
 * evaluation, of whichever function: P^T G^T = 0 and C DF = 0 for their discrete gradients G and
 * gradients at the end C; n_dim*n_node x independent unknowns. If some constraints follow from
 * others, `redundant` are the `*n_redundant` places of these, to be given to emcon_drop, and there
 * are no matrices; a failure where `n_redundant` is NULL. EMCON_ERROR_ANALYSIS: there are no good
 * unknowns to eliminate, solve with the multipliers. */
int emcon_null_space(emcon_model *model, emcon_csr *p, emcon_csr *df, int *n_redundant,
                     const int **redundant);

/* The multipliers, n_constraint, that a residual without contact forces amounts to, by the
 * dependent unknowns of the last null space: `residual` at the nodes, NULL: that of the last
 * emcon_evaluate. 0 where a constraint does not act. */
int emcon_multipliers(emcon_model *model, int n_node,
                      const double *residual /* n_node x n_dim, or NULL */, int n_constraint,
                      double *lam /* n_constraint */);

/* The same for the n_selected rows, in their order. */
int emcon_row_multipliers(emcon_model *model, int n_node,
                          const double *residual /* n_node x n_dim, or NULL */, int n_selected,
                          double *lam /* n_selected */);

/* After emcon_null_space: the motion of dependent unknowns alone that closes the `defect` of the
 * n_selected constraints. Newton's step is this plus DF times that of the others. */
int emcon_particular(emcon_model *model, int n_selected, const double *defect /* n_selected */,
                     int n_node, double *du /* n_node x n_dim */);

/* Sum over the n_selected constraints of the last evaluation of `factor` times the derivative of
 * the discrete gradient by the end of the step, n_dim*n_node x n_dim*n_node, which the tangent gets
 * with a minus sign if the factors are multipliers; and the same times `direction`. */
int emcon_curvature(emcon_model *model, int n_selected, const double *factor /* n_selected */,
                    emcon_csr *matrix);
int emcon_curvature_times(emcon_model *model, int n_selected,
                          const double *factor /* n_selected */, int n_node,
                          const double *direction /* n_node x n_dim */,
                          double *product /* n_node x n_dim */);

/* ---- contact over a step --------------------------------------------------------------------- */

/* All contacts near from displacements u0 to u1. With `keeps_gap` they are those that hold the mean
 * gap of u0, as persistent contact does: all gaps are counted from there. */
int emcon_constraints(emcon_model *model, int n_node, const double *u0 /* n_node x n_dim */,
                      const double *u1 /* n_node x n_dim */, int keeps_gap,
                      emcon_constraint_report *report);

/* Begin a step from the displacements u0 with the motion du that is expected. Flags of n_constraint
 * constraints: which acted at the end of the step before, and which of them still can. One array
 * may be given for both. Any other evaluation ends the step. */
int emcon_begin_contact(emcon_model *model, int n_node, const double *u0 /* n_node x n_dim */,
                        const double *du /* n_node x n_dim */, int n_constraint,
                        const int *was_active /* n_constraint */,
                        int *active /* n_constraint */);

/* From here on rows of gradients, and emcon_curvature, are by unknowns w of the host's, of which the
 * displacements of the nodes are u = A w + what does not change: points of faces of higher order,
 * hanging nodes, rigid bodies, control points. `map` is A, n_dim*n_node x any number; it is copied.
 * Displacements and other arrays of nodes stay what they are; emcon_null_space is refused. */
int emcon_set_map(emcon_model *model, const emcon_csr *map);

/* After emcon_begin_contact, where pairs have friction: velocities along surfaces are to come to
 * rest; without this call, what sticks has them turned round, which takes no energy. `stop` is the
 * motion over the step with which all velocities end at zero: h/2 v0 where the velocity at the end
 * is 2 du/h - v0. */
int emcon_begin_friction(emcon_model *model, int n_node, const double *stop /* n_node x n_dim */);

/* After emcon_begin_contact, where pairs have damping: the size of the step. */
int emcon_begin_damping(emcon_model *model, double h);

/* What damping pushes at the nodes in the step that was evaluated last, to be added to contact forces,
 * and the energy that it takes, >= 0. Its derivative is in emcon_curvature. */
int emcon_law_forces(emcon_model *model, int n_node, double *force /* n_node x n_dim */,
                     double *dissipated);

/* How each constraint holds along the surface by the step that was solved last: 0 where it is open,
 * 1 where it acts and does not slide, 2 where it slides; its slip over the step, and the friction
 * against it, vectors along the surface. Friction times slip is what the step loses, >= 0. */
int emcon_get_slips(emcon_model *model, int n_constraint, int *way /* n_constraint */,
                    double *slip /* n_constraint x n_slip */,
                    double *friction /* n_constraint x n_slip */);

/* All gaps; rows of ties and equations have none. */
int emcon_get_gaps(emcon_model *model, int n_node, const double *u0 /* n_node x n_dim */,
                   const double *du /* n_node x n_dim */, int n_constraint,
                   emcon_gap *gap /* n_constraint */);

/* Select the constraints that act, by flags; `*n` becomes the number of their rows: one of each
 * gap, and those of slips that friction holds. */
int emcon_select(emcon_model *model, int n_node, const double *u0 /* n_node x n_dim */,
                 const double *du /* n_node x n_dim */, int n_constraint,
                 const int *active /* n_constraint */, int *n);

/* Which freedoms contact may couple in the step that was begun, before it is solved: the union over
 * all contacts that have a surface near, whether they act, stick or slide. A pattern with values of
 * 1, n_dim*n_node each way, or by the unknowns of emcon_set_map; emcon_curvature, and products of the
 * rows of a contact, have entries there only. emcon_update_active may look farther: ask again. */
int emcon_pattern(emcon_model *model, int n_node, const double *u0 /* n_node x n_dim */,
                  const double *du /* n_node x n_dim */, emcon_csr *pattern);

/* In place of emcon_select: `active` are candidates, any of which may act, stick or slide; `*n` counts
 * the rows of all gaps and slips. Their multipliers come from emcon_solve_contacts in each iterate of
 * Newton's method: for friction of any size, where sets would come back. emcon_update_active then
 * lets go what does not push once the step is solved. */
int emcon_select_candidates(emcon_model *model, int n_node, const double *u0 /* n_node x n_dim */,
                            const double *du /* n_node x n_dim */, int n_constraint,
                            const int *active /* n_constraint */, int *n);

/* The multipliers that obey the laws of all candidates. With the end gradients C, the directions G
 * and the tangent K of the host `w` is C K^-1 G^T, by rows; `free` is the defect less C K^-1 times the
 * residual without contact forces. Newton's step is then K^-1 (G^T lam - residual). */
int emcon_solve_contacts(emcon_model *model, int n_selected,
                         const double *w /* n_selected x n_selected */,
                         const double *free /* n_selected */, double *lam /* n_selected */);

/* Select n constraints by their numbers, ascending, with gaps to hold of the caller's own choice.
 * emcon_update_active does not go with these. */
int emcon_choose(emcon_model *model, int n_node, const double *u0 /* n_node x n_dim */,
                 const double *du /* n_node x n_dim */, int n, const int *id /* n */,
                 const double *target /* n */);

/* Values and gradients of the selected constraints. */
int emcon_evaluate_contact(emcon_model *model, int n_node, const double *u0 /* n_node x n_dim */,
                           const double *du /* n_node x n_dim */, emcon_constraint_report *report);

/* The next active set from a solved step: takes in what would penetrate, releases what pulls.
 * `lam`: the multipliers of the n_selected rows, forces, of gaps > 0 pressing. `active`: those
 * selected, then the next ones. `*is_done`: the set stands, or `*outcome` is not EMCON_STEP_DONE
 * and the step cannot be ended. `magnitude`: sums of the sizes of the contributions to the
 * residual, which tell signs of round-off from tension; NULL: the contact forces themselves. */
int emcon_update_active(emcon_model *model, int n_node, const double *u0 /* n_node x n_dim */,
                        const double *du /* n_node x n_dim */, int n_selected,
                        const double *lam /* n_selected */,
                        const double *magnitude /* n_node x n_dim, or NULL */, int n_constraint,
                        int *active /* n_constraint, in and out */, int *is_done, int *outcome);

/* Leave selected constraints out for the rest of the step; `active`: what is left. */
int emcon_drop(emcon_model *model, int n_redundant, const int *redundant /* n_redundant */,
               int n_constraint, int *active /* n_constraint */);

/* Areas that the multipliers of the step to `u1` act on, so that the pressure is lam/area, and
 * lengths of slave surface that belong to them at its end; in space about the roots of these
 * areas. */
int emcon_get_areas(emcon_model *model, int n_node, const double *u1 /* n_node x n_dim */,
                    int n_constraint, double *area /* n_constraint */,
                    double *length /* n_constraint */);

/* The deepest overlap of bodies in a step, per edge, found by geometry alone, whatever contact
 * says; and the node that is behind, -1: none. Surfaces of pairs are their outlines: of two of
 * which neither closes around its body nothing is found. */
int emcon_overlap(emcon_model *model, int n_node, const double *u0 /* n_node x n_dim */,
                  const double *du /* n_node x n_dim */, double *depth, int *node);

/* ---- tables: what decks may say -------------------------------------------------------------- */

/* Value number `i`, from 0, of all options of decks that are one of a few words: its code, whether
 * it is taken where a deck says nothing, and in `text` the option, the word in decks, the name in
 * these headers, what the log says, the models that may have it (of "plane axial space") and what
 * others use, with line ends between these six; all but the first two and the models may be empty.
 * EMCON_ERROR_INPUT behind the last value, and if there is too little room, or NULL. */
int emcon_get_option(int i, int *code, int *is_default, int n_text, char *text /* n_text */);

/* Law number `i`, from 0: its code, and in `text` its name, its keyword and parameter in decks, and
 * the names of its constants between blanks, with line ends between these four.
 * EMCON_ERROR_INPUT behind the last law, and if there is too little room, or NULL. */
int emcon_get_law(int i, int *code, int n_text, char *text /* n_text */);

/* ---- single kernels, for tests and for trying things out ------------------------------------- */

/* The law of this code, with its n constants, for a strain 11, 22, 2*12 that goes from `strain`
 * by `dstrain`: the energy at the end, the algorithmic stress S with S . dstrain = change of
 * energy, and its derivative by the strain at the end. EMCON_ERROR_INPUT for no such law,
 * constants that it refuses, or NULL. */
int emcon_law_response(int law, int n, const double *constant /* n */,
                       const double *strain /* 3 */, const double *dstrain /* 3 */,
                       double *energy, double *stress /* 3 */, double *tangent /* 3 x 3 */);

/* Gap of a slave node over an edge and its neighbours, from positions `x0` by `dx` of the slave,
 * the edge's start and end, and the nodes before and after it (not read unless `has_before`,
 * `has_after`); corners are rounded over a length `rounding`. The gap at the start, at the end and
 * their difference; discrete gradient g, gradient at the end c, derivative of g by the end. */
int emcon_node_gap(const double *x0 /* 5 x 2 */, const double *dx /* 5 x 2 */, int has_before,
                   int has_after, double rounding, double *gap /* 3 */, double *g /* 10 */,
                   double *c /* 10 */, double *h /* 10 x 10 */);

#ifdef __cplusplus
}
#endif

#endif
