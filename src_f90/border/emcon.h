/* EMCON: energy-momentum conserving contact dynamics. The interface for C (C99) and C++.
 *
 * A model is a deck together with the present state of its analysis; or nodes, surfaces, contact
 * pairs and ties of a host code, which has solids and time steps of its own. All state is in the
 * model: any number of models may exist at once, each used by one thread at a time. No function
 * stops the program or prints. Functions that can fail return EMCON_OK or an error code; the
 * message stays with the model until the next failure. A call that fails leaves the model
 * unchanged, unless its comment says otherwise. Do not use a model after it was closed: the library
 * cannot detect this.
 *
 * Arrays belong to the caller, who passes their lengths. Arrays of nodes hold x, y and in space z
 * of node 0, then of node 1 and so on, n_dim*n_node numbers, in the order of the deck
 * (emcon_get_labels). n_dim is 2 or 3, as the deck is; emcon_get_sizes returns it once the deck is
 * read. An output that is NULL is left out. Inputs that may be NULL are marked. Labels and degrees
 * of freedom (1 to n_dim) are those of the deck; everything else is counted from 0, in messages
 * from 1. Units are those of the deck.
 */
#ifndef EMCON_H
#define EMCON_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Semantic versioning: a program runs with each library that has the same major version (as long as
 * that is 0, the same minor version) and is not older than the header it was compiled with. */
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

/* The meaning of a code in a few words, a constant text; emcon_message has the details of the last
 * failure. */
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
   int n_contact;    /* possible contacts: slave nodes of all pairs, then those of guards */
   int n_pair;       /* contact pairs; one that stops nodes of both sides counts as two */
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
   int n_pair_total; /* numbers of emcon_get_pairs for each pair: 2*n_momentum + 1 */
} emcon_sizes;

typedef struct emcon_increment {
   double h;
   double time;      /* at the end of the increment */
   int n_newton;     /* iterations, over all cuts and active sets */
   int n_cut;
   int n_active;     /* contacts */
   double penetration;  /* deepest one at the end by the overlap check, in edge lengths */
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
   double stabilization;   /* work of the supports of *CONTACT CONTROLS, STABILIZE */
   double restitution_loss;   /* part of contact_work: lost in impacts by RESTITUTION, >= 0 */
   double scheme_loss;        /* dissipated by the time integration scheme, >= 0 */
   double damping_loss;       /* dissipated by *DAMPING of materials, >= 0 */
   double contact_energy;     /* stored by contact with a penalty, >= 0 */
   double friction_loss;      /* dissipated by friction, >= 0 */
   double pz, lx, ly;         /* 0 in the plane */
   double contact_damping_loss;   /* dissipated by *CONTACT DAMPING, >= 0 */
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

/* Constraints over a step, in ascending order of their numbers. Row k keeps a gap at target[k]:
 * f_k, the difference of gap and target times the share of the surface that is covered, has to be
 * 0. Its force on the nodes is its multiplier times row k of `discrete_gradient`; Newton's method
 * linearises f_k by row k of `end_gradient`. In statics gap0 is the gap at the end, dgap is 0, and
 * both gradients are the same. With friction, contacts that stick have further rows, one for each
 * slip, after those of all gaps: there f_k is target[k] minus the slip, and the multiplier is the
 * friction. For a contact that slides, the `discrete_gradient` of its gap contains the friction, mu
 * times the multiplier. The arrays belong to the model, as those of a matrix. */
typedef struct emcon_constraint_report {
   int n;
   const int *id;                 /* number among the n_constraint constraints */
   const int *pair;               /* number of the contact pair; -1: of a tie or an equation */
   const int *node;               /* number of the slave node; -1 likewise */
   const double *target;          /* > 0 is open; of mortar contact a weighted mean */
   const double *gap0;            /* f at the start */
   const double *gap1;            /* f at the end */
   const double *dgap;            /* gap1 - gap0, to relative accuracy */
   const double *defect;          /* has to be 0: dgap if the gap of the start is kept, else gap1 */
   const double *size;            /* length of an edge, to which defects relate */
   emcon_csr discrete_gradient;   /* n x n_dim*n_node, times the motion it is dgap */
   emcon_csr end_gradient;        /* n x n_dim*n_node, the gradient at the end */
   const int *slip;               /* 0: a row of a gap; else of which slip, from 1 */
} emcon_constraint_report;

/* Gap of a possible contact at both ends of a step. */
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

/* Options of a pair. 0 is the default of each: begin with `emcon_pair_options options = {0}`. */
typedef struct emcon_pair_options {
   int integration;         /* of mortar contact; default EMCON_SEGMENTS, exactly by segments */
   int n_point;             /* Gauss points, 2..10 on segments, 1..10 on elements */
   int multiplier;          /* of mortar contact; default EMCON_DUAL */
   int normal;              /* of slave nodes; default EMCON_NODAL_NORMAL, the mean of the edges' */
   int smoothing;           /* of the master surface; default EMCON_UNSMOOTHED */
   double normal_angle;     /* sharper turns are corners, 0..180 degrees; default 60 */
   double smoothing_angle;  /* the same for smoothing */
   double friction;         /* coefficient of Coulomb's law, >= 0 */
   double adjust;           /* emcon_build moves slave nodes that are behind the master, or no
                               farther from it than this, onto it: read the new positions by
                               emcon_get_positions; 0: none are moved */
   double damping;          /* pressure over velocity of approach, >= 0 */
   double damping_clearance;   /* gap beyond which there is no damping, >= 0 */
   double damping_flat;     /* part of the clearance with the full damping, 0 to 1 */
   double tangent_fraction; /* damping against slip over that against approach, >= 0 */
} emcon_pair_options;

/* How contact begins in the steps of a host; 0 is the default. */
typedef struct emcon_contact_settings {
   int initiation;          /* EMCON_PERSISTENT, the default: a new contact keeps the gap that it had
                               at the start of the step, which conserves energy; EMCON_ADMISSIBLE
                               closes the gap, which dissipates energy */
   double gap_tolerance;    /* largest gap at which a contact may begin, in edge lengths; 0: any */
   int is_last_try;         /* 1: the host cannot repeat the step in smaller parts */
   int is_end;              /* 1: statics: gradients at the end of the step, closed gaps; to be set
                               before emcon_build, too */
} emcon_contact_settings;

/* How the search for the active set ended. After any but the first repeat the step in smaller
 * parts. */
enum {
   EMCON_STEP_DONE = 0,
   EMCON_STEP_CYCLING = 5,     /* a set came back that had been tried before */
   EMCON_STEP_TOO_FAR = 6,     /* nodes moved out of the faces that the search had found */
   EMCON_STEP_STANDS_OFF = 7   /* a contact would begin at a gap above gap_tolerance */
};

/* Called after each increment; anything but 0 stops the run. */
typedef int (*emcon_progress)(void *user, const emcon_increment *increment, double fraction_done);

/* Called with each line that the program would write to its log. */
typedef void (*emcon_log)(void *user, const char *line);

/* The version of the library, which may be newer than the header. */
void emcon_version(int *major, int *minor, int *patch);

/* ---- reading and building -------------------------------------------------------------------- */

/* Read a deck, without building its model. `parameters`: lines NAME=VALUE, or NULL. `is_lenient`:
 * unknown keywords are no errors. Close `*model` also after a failure: it holds the messages about
 * the deck, and nothing else can be done with it. */
int emcon_read(const char *deck, const char *parameters /* or NULL */, int is_lenient,
               emcon_model **model);

/* The same for a deck in memory. `name` is the name of the file in messages; included files are
 * sought in its folder. */
int emcon_read_text(const char *text, const char *name, const char *parameters /* or NULL */,
                    int is_lenient, emcon_model **model);

/* The same for a text that was made from several files, for messages. A passage of it is four
 * numbers: how many lines it has; the number of its file in `names` (one per line), from 1; its
 * first line in that file; and 1 if its lines are consecutive there, 0 if messages about each of
 * them name the first. */
int emcon_read_passages(const char *text, int n_passage, const int *passage /* n_passage x 4 */,
                        const char *names, const char *parameters /* or NULL */,
                        int is_lenient, emcon_model **model);

/* Build the model of the deck that was read, and begin its first step. After a failure the model
 * can only be closed. */
int emcon_build(emcon_model *model);

/* Read a deck and build its model. */
int emcon_open(const char *deck, const char *parameters /* or NULL */, int is_lenient,
               emcon_model **model);

/* Free a model with all arrays that it returned. NULL is allowed. Snapshots stay valid. */
void emcon_close(emcon_model *model);

/* The text of the last failure, "" if there was none, NULL for NULL; valid until the next call
 * with the model. */
const char *emcon_message(emcon_model *model);

/* ---- what is given between reading and building ---------------------------------------------- */

/* Functions of the program: laws, potentials, and the solid of a host code. They are called
 * whenever the model is stepped or queried, in the thread that does so, and must remain valid as
 * long as the model. They return 0; or 1 for a state that has no energy, such as an inverted
 * element: the step is then repeated in smaller parts; or any other value, which makes the call of
 * the library fail. A function must not call the library with the model that calls it. */

/* An energy at n_point points z of n_variable variables each, z[n_variable*point + variable]:
 * `value` (n_point), `gradient` (n_point x n_variable), and unless it is NULL `hessian` (n_point x
 * n_variable x n_variable). The library computes the discrete gradient, which conserves energy. */
typedef int (*emcon_point_function)(void *user, int n_point, int n_variable, const double *z,
                                    int wants_hessian, double *value, double *gradient,
                                    double *hessian);

/* Forces of a step from displacements `u0` by `du`, both n_dim*n_node: `force` (n_dim*n_node), the
 * energy at the end, and unless it is NULL `tangent`, the derivative of the forces by u0 + du, in
 * the slots of the pattern that was given. Energy is conserved if force . du is its change. For du
 * = 0 the forces are the gradient of the energy, and the tangent is half its second derivative.
 * `magnitude` (n_dim*n_node), sums of |contributions| to the forces, sets the size of round-off; if
 * left at 0, |force| is used. */
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

/* Forces between nodes: `pattern` (n_dim*n_node x n_dim*n_node, its values are not used) has an
 * entry where a force depends on a displacement. Nodes without elements belong to the model if they
 * are in the pattern. */
int emcon_give_force(emcon_model *model, const char *name /* or NULL */, const emcon_csr *pattern,
                     emcon_force_function force, void *user);

/* Mass in addition to that of the elements, n_node x n_node, the same in all directions. */
int emcon_give_mass(emcon_model *model, const emcon_csr *mass);

/* ---- a model of a host code ------------------------------------------------------------------ */

/* Instead of reading a deck: nodes, then surfaces, pairs and ties, then emcon_build. The host makes
 * the steps, by emcon_solve_step or by all calls of "contact over a step". Labels are the numbers of
 * nodes, from 1. A complete host: tests/embed/interface_bars.c. The notation is that of
 * docs/theory.md, sections 4 and 5. Units are consistent ones; the plane has thickness 1. */

/* Nodes at the reference positions `x`, n_dim = 2 or 3. Nodes that are on no surface may be left
 * out. Close `*model` also after a failure. */
int emcon_new(int n_node, int n_dim, const double *x /* n_node x n_dim */, emcon_model **model);

/* Add a surface of the plane: first and last node of each edge, 2*n_edge numbers, the body to the
 * left, so that the outward normal is the edge turned by -90 degrees. Edges in any order, connected
 * or in parts, open or closed. `name` is for messages, NULL: its number. `*surface` is its number.
 * */
int emcon_add_surface(emcon_model *model, const char *name /* or NULL */, int n_edge,
                      const int *edge /* n_edge x 2 */, int *surface);

/* Add a surface of faces whose kinds may differ, in any order, connected or in parts, open or
 * closed. `kind` as VTK numbers cells: in space triangles 5 and quadrilaterals 9, with a node in
 * the middle of each side 22 and 23; in the plane edges, 3. `offset`: where the nodes of each face
 * end in `node`, as in files of VTK. `node`: the nodes of all faces one after the other, of each
 * its corners counter-clockwise as seen from outside the body, then its mid-side nodes, beginning
 * with that between the first two corners. */
int emcon_add_faces(emcon_model *model, const char *name /* or NULL */, int n_face,
                    const int *kind /* n_face */, const int *offset /* n_face */, int n_entry,
                    const int *node /* n_entry */, int *surface);

/* Add a contact pair; a surface in contact with itself is its own master. `options` NULL: the
 * defaults. A rigid obstacle is a master whose nodes are held. In space the formulation is
 * EMCON_MORTAR or EMCON_NODE_TO_SEGMENT, which stops the nodes of the slave; a second pair with
 * slave and master exchanged stops those of the master, too. */
int emcon_add_pair(emcon_model *model, int slave, int master, int formulation,
                   const emcon_pair_options *options /* or NULL */);

/* Tie two surfaces, whose meshes may differ. `multiplier`: EMCON_STANDARD or EMCON_DUAL;
 * `tolerance`: largest distance between them, < 0: a tenth of an edge. emcon_build moves slave
 * nodes onto their masters: read the new positions by emcon_get_positions. */
int emcon_add_tie(emcon_model *model, int slave, int master, int multiplier, double tolerance);

/* Degrees of freedom that the host prescribes: 1, else 0. None if this is not called. */
int emcon_hold(emcon_model *model, int n_node, const int *held /* n_node x n_dim */);

/* Change settings of contact, also between steps. */
int emcon_set_contact(emcon_model *model, const emcon_contact_settings *settings);

/* ---- the run of the deck --------------------------------------------------------------------- */

/* Use n threads from now on. The default is OMP_NUM_THREADS, or 1 if that is not set. Results have
 * the same bits for any number. */
int emcon_set_threads(emcon_model *model, int n);

/* One increment on the time grid of the deck; an error if there is none left. After a failed
 * increment the state is that of its last part that succeeded. */
int emcon_advance(emcon_model *model, emcon_increment *increment);

/* 1 after the last increment of the last step, else 0; 1 also for NULL. */
int emcon_is_done(emcon_model *model);

/* Increments until `time` is reached, or the end of the deck. Callbacks may be NULL. */
int emcon_run(emcon_model *model, double time, emcon_progress progress, emcon_log log, void *user);

/* Write the files of a run of the program, from the present state on: `base`.vtkhdf, .h5 and .csv
 * after each increment, by whichever function it is made, and `base`.log. emcon_end_record adds
 * `base`.json and ends the record; so does closing the model, without that file. If a file cannot
 * be written, the record ends and the call for the increment returns EMCON_ERROR_FILE. */
int emcon_record(emcon_model *model, const char *base);
int emcon_end_record(emcon_model *model);

/* ---- steps of any size ----------------------------------------------------------------------- */

/* One step of the size h > 0 under the conditions of the present step of the deck, cut into parts
 * if it fails. It may end at any time, also after the end of the deck's step: amplitudes and ramps
 * keep their last value there. emcon_advance continues only from points of the deck's time grid. */
int emcon_step(emcon_model *model, double h, emcon_increment *increment);

/* Begin the next step of the deck at the present time. */
int emcon_next_step(emcon_model *model);

/* Replace parts of the state. Each array may be NULL; a count is used only if one of its arrays is
 * given. Dependent nodes of ties and equations follow the others. Energies and momenta are computed
 * again; works, which are sums over time, stay. `lam` is 0 for constraints that do not act; `time`
 * is not before the start of the present step of the deck. A new `u` deletes the forces of the last
 * step. */
int emcon_set_state(emcon_model *model, int n_node, const double *u /* n_node x n_dim, or NULL */,
                    const double *v /* n_node x n_dim, or NULL */, int n_constraint,
                    const double *lam /* n_constraint, or NULL */,
                    const int *is_active /* n_constraint, or NULL */,
                    const double *time /* 1, or NULL */);

/* Keep the present state; `*snapshot` is NULL after a failure. It stays valid if the model is
 * closed. */
int emcon_take_snapshot(emcon_model *model, emcon_snapshot **snapshot);

/* Return to a state of this model that was kept: what follows has the same bits. The step of the
 * deck is that of the snapshot; loads and boundary values stay as they are now. */
int emcon_restore_snapshot(emcon_model *model, const emcon_snapshot *snapshot);

/* Free a snapshot; NULL is allowed. */
void emcon_free_snapshot(emcon_snapshot *snapshot);

/* Write deck, state and conditions of the present step to a file. emcon_load makes a model from it
 * that continues with the same bits; close `*model` also after a failure. Laws, potentials and
 * forces of the program are not in the file: if there are any, read the deck, give them, and call
 * emcon_resume with the file in place of emcon_build. */
int emcon_save(emcon_model *model, const char *path);
int emcon_load(const char *path, emcon_model **model);
int emcon_resume(emcon_model *model, const char *path);

/* ---- what a model holds ---------------------------------------------------------------------- */

/* Before emcon_build only n_node, n_element, n_step, n_dim, n_slip, n_momentum and n_pair_total are
 * known; the others are 0. */
int emcon_get_sizes(emcon_model *model, emcon_sizes *sizes);

int emcon_get_time(emcon_model *model, double *time);

/* Fraction of the run of the deck that is done, 0 to 1, and the time at which its last step ends.
 * */
int emcon_get_progress(emcon_model *model, double *fraction, double *t_end);

int emcon_get_ledger(emcon_model *model, emcon_ledger *ledger);

/* The verdict on all increments that led to this state: is the energy balance closed, is no body in
 * another, is every residual within the tolerance? `*json` is the line that a run of the deck
 * writes to NAME.json. It belongs to the model and is valid until the next call of this function,
 * or until the model is closed. A snapshot contains its verdict. */
int emcon_get_verdict(emcon_model *model, int *is_good, const char **json);

/* Warnings about the deck, and what was changed before the first step, one per line. `*text` is
 * valid as long as the text of emcon_get_verdict. */
int emcon_get_notes(emcon_model *model, const char **text);

/* Bodies, pairs, ties, sizes, the parts of the program in use, advice: the report of `emcon check
 * --json` without the cost, one JSON object. `*json` is valid as long as that of
 * emcon_get_verdict. */
int emcon_get_report(emcon_model *model, const char **json);

/* Which nodes are in the node set `name`: 1, else 0. */
int emcon_find_nodes(emcon_model *model, const char *name, int n_node, int *is_in /* n_node */);

/* The names that sets and surfaces have in the deck, a line each: `node set RING`, `element set
 * RING`, `surface RING_OUTER`. `*text` is valid as long as the text of emcon_get_verdict. */
int emcon_get_names(emcon_model *model, const char **text);

/* Which elements are in the element set `name`: 1, else 0; which of their faces in the surface
 * `name`, as the deck counts them: face 1 is the first. */
int emcon_find_elements(emcon_model *model, const char *name, int n_element,
                        int *is_in /* n_element */);
int emcon_find_faces(emcon_model *model, const char *name, int n_element,
                     int *is_in /* n_element x 6 */);

/* Elements: labels, the number that VTK has for their kind (5: CPE3, 9: CPE4, 10: C3D4, 12: C3D8,
 * and so on), and their nodes in VTK's order, which is that of the deck; -1 after the last. */
int emcon_get_elements(emcon_model *model, int n_element, int *label /* n_element */,
                       int *kind /* n_element */, int *node /* n_element x 20 */);

/* Number of the body of each node, below n_body; -1: none. */
int emcon_get_bodies(emcon_model *model, int n_node, int *body /* n_node */);

/* Labels of the nodes, n_node. */
int emcon_get_labels(emcon_model *model, int n_node, int *label /* n_node */);

/* Reference positions. emcon_build may move nodes, to close a tie or an initial contact. */
int emcon_get_positions(emcon_model *model, int n_node, double *x /* n_node x n_dim */);

/* Displacements and velocities. */
int emcon_get_state(emcon_model *model, int n_node, double *u /* n_node x n_dim */,
                    double *v /* n_node x n_dim */);

/* For each constraint: its multiplier, a force, and whether it acts. */
int emcon_get_multipliers(emcon_model *model, int n_constraint, double *lam /* n_constraint */,
                          int *is_active /* n_constraint */);

/* The same for each possible contact, with the label of its slave node and the number of its pair.
 * */
int emcon_get_contact(emcon_model *model, int n_contact, double *lam /* n_contact */,
                      int *is_active /* n_contact */, int *label /* n_contact */,
                      int *pair /* n_contact */);

/* Pressure of each possible contact, 0 where open, and its gap, NaN where no surface is near: CSTR
 * and CDIS of the deck. */
int emcon_get_pressures(emcon_model *model, int n_contact, double *pressure /* n_contact */,
                        double *gap /* n_contact */);

/* For each possible contact, 0 without *FRICTION: its traction against slip; 1 if it sticks, 2 if
 * it slides; its slip along the surface since the start, and the length of its path: CSHEAR and
 * CSLIP of the deck. Traction and slip are vectors along the surface, with one component in the
 * plane. */
int emcon_get_friction(emcon_model *model, int n_contact, double *shear /* n_contact x n_slip */,
                       int *way /* n_contact */, double *slip /* n_contact x n_slip */,
                       double *path /* n_contact */);

/* For each pair: the energy dissipated by friction since the start, >= 0. A pair that stops nodes
 * of both sides counts as two: the first has all of it, the second 0. The sum is `friction_loss` of
 * the ledger. */
int emcon_get_pair_friction(emcon_model *model, int n_pair, double *loss /* n_pair */);

/* For each pair: force and moment about the origin on the slave side, in the plane fx, fy, m, in
 * space fx, fy, fz, mx, my, mz; the same on the master side; length in contact, in space area; and
 * the number of active contacts. */
int emcon_get_pairs(emcon_model *model, int n_pair, double *total /* n_pair x n_pair_total */,
                    int *n_active /* n_pair */);

/* The present values of an output variable of decks, such as U, V, RF, S, E, ENER, CDIS, CSTR, CF:
 * `*n_component` numbers for each of `*n_place` nodes, for E, ENER, ELKE and EVOL elements. S has
 * six components of Cauchy's stress, then von Mises' stress. The array belongs to the model and is
 * valid until the next call of this function, or until the model is closed. */
int emcon_get_field(emcon_model *model, const char *name, int *n_place, int *n_component,
                    const double **value);

/* For each body: momentum, and angular momentum about the origin; in the plane px, py, lz, in space
 * px, py, pz, lx, ly, lz. */
int emcon_get_momenta(emcon_model *model, int n_body, double *momenta /* n_body x n_momentum */);

/* ---- loads and boundary values --------------------------------------------------------------- */

/* Changes apply to the present step of the deck. With an amplitude, a value is the factor of the
 * amplitude. Without one, loads of a static step change linearly from their present value to the
 * new value at the end of the step; in a dynamic step the value acts from the next increment on. */

/* Number of the load of this kind on node or element `label`, the first if there are several;
 * `place` is the degree of freedom of a force, the face of a pressure, and ignored for gravity. */
int emcon_find_load(emcon_model *model, int kind, int label, int place, int *load);

/* Give load 0 <= `load` < n_load of the present step a value. */
int emcon_set_load(emcon_model *model, int load, double value);

/* Add `n` loads of one kind where the present step has none of it: `place` as above, gravity along
 * `direction`, of any length. In a static step they grow linearly from 0 to their values at its
 * end. After a failure none is added. */
int emcon_add_loads(emcon_model *model, int kind, int n, const int *label /* n */,
                    const int *place /* n */, const double *value /* n */,
                    const double *direction /* 3, or NULL */);

/* Degree of freedom `dof` of node `label`: change the value of its boundary condition; prescribe
 * it, if it is free; the one or the other, whichever applies; release it. If the number of unknowns
 * changes they are numbered again, and the state stays. */
int emcon_set_prescribed(emcon_model *model, int label, int dof, double value);
int emcon_add_prescribed(emcon_model *model, int label, int dof, double value);
int emcon_prescribe(emcon_model *model, int label, int dof, double value);
int emcon_remove_prescribed(emcon_model *model, int label, int dof);

/* ---- what the engine computes for a step ----------------------------------------------------- */

/* Queries change neither the state nor any bit of later steps. The displacements of all nodes are T
 * times the unknowns, plus prescribed motion. */

/* Number of the unknown of each degree of freedom, n_dim*n_node; -1: prescribed, dependent, or
 * without an element. */
int emcon_unknowns(emcon_model *model, int n_node, int *unknown /* n_node x n_dim */);

/* T, n_dim*n_node x n_unknown: row n_dim*node + direction. */
int emcon_links(emcon_model *model, emcon_csr *matrix);

/* emcon_follow computes the dependent freedoms of a displacement or velocity from the others;
 * emcon_gather moves forces on dependent freedoms to those that they follow. `field` is changed in
 * place, and unchanged after a failure. */
int emcon_follow(emcon_model *model, int n_node, double *field /* n_node x n_dim, in and out */);
int emcon_gather(emcon_model *model, int n_node, double *field /* n_node x n_dim, in and out */);

/* D and M of a tie, over nodes, one row for each multiplier: D x = M x in each direction. */
int emcon_get_tie_matrices(emcon_model *model, int tie, emcon_csr *d, emcon_csr *m);

/* The consistent mass, n_node x n_node, the same in all directions. */
int emcon_mass(emcon_model *model, emcon_csr *matrix);

/* Displacements with which the iteration of a step of the size h from the present state begins. */
int emcon_guess(emcon_model *model, double h, int n_node, double *u1 /* n_node x n_dim */);

/* Evaluate the step of the size h from the present state to displacements `u1`. The functions below
 * return results of the last evaluation. The constraints that act are those of the state, or
 * `is_active` unless it is NULL, without those that have no surface near; their multipliers are
 * those of the state, or `lam` unless it is NULL. */
int emcon_evaluate(emcon_model *model, double h, int n_node, const double *u1 /* n_node x n_dim */,
                   int with_tangent, int n_constraint,
                   const double *lam /* n_constraint, or NULL */,
                   const int *is_active /* n_constraint, or NULL */);

/* Residual: inertia plus internal forces minus loads, and `with_contact` minus contact forces: at
 * the nodes, where it is the reaction on prescribed freedoms; and by unknowns, T^T times that. */
int emcon_residual(emcon_model *model, int with_contact, int n_node,
                   double *nodal /* n_node x n_dim */, int n_unknown,
                   double *unknown /* n_unknown */);

/* Derivative of the residual with respect to the unknowns at the end of the step, n_unknown x
 * n_unknown, for fixed multipliers; `with_contact` with the second derivatives of the gaps. It
 * needs an evaluation with `with_tangent`. */
int emcon_tangent(emcon_model *model, int with_contact, emcon_csr *matrix);

/* Null-space matrix P, and DF of the reparametrisation, for the constraints that act in the last
 * evaluation, by whichever function: P^T G^T = 0 and C DF = 0 for their discrete gradients G and
 * gradients at the end C; n_dim*n_node x independent unknowns. If some constraints depend on
 * others, there are no matrices; `redundant` are their `*n_redundant` places, to be passed to
 * emcon_drop; if `n_redundant` is NULL, this is a failure. EMCON_ERROR_ANALYSIS: there are no good
 * unknowns to eliminate; solve with the multipliers instead. */
int emcon_null_space(emcon_model *model, emcon_csr *p, emcon_csr *df, int *n_redundant,
                     const int **redundant);

/* The multipliers, n_constraint, that balance a residual without contact forces in the dependent
 * unknowns of the last null space. `residual` is at the nodes; NULL: that of the last
 * emcon_evaluate. 0 for constraints that do not act. */
int emcon_multipliers(emcon_model *model, int n_node,
                      const double *residual /* n_node x n_dim, or NULL */, int n_constraint,
                      double *lam /* n_constraint */);

/* The same for the n_selected rows, in their order. */
int emcon_row_multipliers(emcon_model *model, int n_node,
                          const double *residual /* n_node x n_dim, or NULL */, int n_selected,
                          double *lam /* n_selected */);

/* After emcon_null_space: the motion of the dependent unknowns that makes the `defect` of the
 * n_selected constraints 0. Newton's step is this plus DF times that of the independent ones. */
int emcon_particular(emcon_model *model, int n_selected, const double *defect /* n_selected */,
                     int n_node, double *du /* n_node x n_dim */);

/* Sum over the n_selected constraints of the last evaluation of `factor` times the derivative of
 * the discrete gradient with respect to the end of the step, n_dim*n_node x n_dim*n_node. With
 * multipliers as factors it is subtracted from the tangent. The second function returns its product
 * with `direction`. */
int emcon_curvature(emcon_model *model, int n_selected, const double *factor /* n_selected */,
                    emcon_csr *matrix);
int emcon_curvature_times(emcon_model *model, int n_selected,
                          const double *factor /* n_selected */, int n_node,
                          const double *direction /* n_node x n_dim */,
                          double *product /* n_node x n_dim */);

/* ---- contact over a step --------------------------------------------------------------------- */

/* All contacts that have a surface near, from displacements u0 to u1. With `keeps_gap` each keeps
 * the gap of u0, as persistent contact does, and gaps are counted from there. */
int emcon_constraints(emcon_model *model, int n_node, const double *u0 /* n_node x n_dim */,
                      const double *u1 /* n_node x n_dim */, int keeps_gap,
                      emcon_constraint_report *report);

/* Begin a step from the displacements u0 with the expected motion du. `was_active`: 1 for
 * constraints that acted at the end of the step before; `active`: 1 for those of them that still
 * have a surface near. Both may be the same array. Any other evaluation ends the step. */
int emcon_begin_contact(emcon_model *model, int n_node, const double *u0 /* n_node x n_dim */,
                        const double *du /* n_node x n_dim */, int n_constraint,
                        const int *was_active /* n_constraint */,
                        int *active /* n_constraint */);

/* From now on rows of gradients, and emcon_curvature, are by unknowns w of the host, with u = A w +
 * constant for the displacements of the nodes: for faces of higher order, hanging nodes, rigid
 * bodies, control points. `map` is A, n_dim*n_node x any number; it is copied. Displacements and
 * other arrays of nodes are given as before; emcon_null_space is refused. */
int emcon_set_map(emcon_model *model, const emcon_csr *map);

/* After emcon_begin_contact, if pairs have friction, in dynamic steps: nodes that stick end with
 * velocity 0 along the surface. Without this call their velocity along the surface is reversed,
 * which dissipates nothing. `stop` is the motion over the step with which all velocities end at 0:
 * h/2 v0, if the velocity at the end is 2 du/h - v0. */
int emcon_begin_friction(emcon_model *model, int n_node, const double *stop /* n_node x n_dim */);

/* After emcon_begin_contact, if pairs have damping: the size of the step. */
int emcon_begin_damping(emcon_model *model, double h);

/* Forces of damping at the nodes in the step that was evaluated last, to be added to contact
 * forces, and the energy that they dissipate, >= 0. Their derivative is in emcon_curvature. */
int emcon_law_forces(emcon_model *model, int n_node, double *force /* n_node x n_dim */,
                     double *dissipated);

/* For each constraint, by the step that was solved last: 0 if it is open, 1 if it acts and does not
 * slide, 2 if it slides; its slip over the step, and the friction against it, vectors along the
 * surface. Friction times slip is the energy that the step dissipates, >= 0. */
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
 * all contacts that have a surface near, whether they act, stick or slide. A square matrix with
 * entries of 1, by n_dim*n_node freedoms or by the unknowns of emcon_set_map; emcon_curvature and
 * products of the rows of a contact have no other entries. emcon_update_active may find further
 * surfaces: call this again after it. */
int emcon_pattern(emcon_model *model, int n_node, const double *u0 /* n_node x n_dim */,
                  const double *du /* n_node x n_dim */, emcon_csr *pattern);

/* In place of emcon_select: `active` are candidates, each of which may be open, stick or slide;
 * `*n` counts the rows of all gaps and slips. In each iterate of Newton's method
 * emcon_solve_contacts computes their multipliers. Use this if the search with emcon_select ends
 * with EMCON_STEP_CYCLING, as it may with large friction. After the step is solved,
 * emcon_update_active releases candidates without force. */
int emcon_select_candidates(emcon_model *model, int n_node, const double *u0 /* n_node x n_dim */,
                            const double *du /* n_node x n_dim */, int n_constraint,
                            const int *active /* n_constraint */, int *n);

/* The multipliers that satisfy the laws of contact and friction of all candidates. With the
 * gradients at the end C, the discrete gradients G and the host's tangent K, `w` is C K^-1 G^T, by
 * rows, and `free` is the defect minus C K^-1 times the residual without contact forces. Newton's
 * step is then K^-1 (G^T lam - residual). */
int emcon_solve_contacts(emcon_model *model, int n_selected,
                         const double *w /* n_selected x n_selected */,
                         const double *free /* n_selected */, double *lam /* n_selected */);

/* Select n constraints by their numbers, ascending, and the gaps that they keep. They cannot be
 * passed to emcon_update_active. */
int emcon_choose(emcon_model *model, int n_node, const double *u0 /* n_node x n_dim */,
                 const double *du /* n_node x n_dim */, int n, const int *id /* n */,
                 const double *target /* n */);

/* Values and gradients of the selected constraints. */
int emcon_evaluate_contact(emcon_model *model, int n_node, const double *u0 /* n_node x n_dim */,
                           const double *du /* n_node x n_dim */, emcon_constraint_report *report);

/* The next active set from a solved step: adds contacts that penetrate, releases those that pull.
 * `lam`: multipliers of the n_selected rows, forces; those of gaps press if > 0. `active`: the
 * selected constraints, on return the next set. `*is_done`: 1 if the set does not change, or if
 * `*outcome` is not EMCON_STEP_DONE and the step cannot be completed. `magnitude`: sums of
 * |contributions| to the residual, to tell round-off from tension; NULL: the contact forces are
 * used. */
int emcon_update_active(emcon_model *model, int n_node, const double *u0 /* n_node x n_dim */,
                        const double *du /* n_node x n_dim */, int n_selected,
                        const double *lam /* n_selected */,
                        const double *magnitude /* n_node x n_dim, or NULL */, int n_constraint,
                        int *active /* n_constraint, in and out */, int *is_done, int *outcome);

/* The equations of a host without contact, for emcon_solve_step: find the residual of the step by
 * `du` (n_freedom = n_dim*n_node), and its derivative K by the unknowns at the end, from which
 * `second` is subtracted (n_unknown x n_unknown). Add the residual to the last of the columns, which
 * are stored one after the other (n_column x n_unknown); then replace each column b by K^-1 b.
 * Unknowns are those of emcon_set_map; without a map the freedoms of all nodes, of which those that
 * are held come out as 0. Return 0, or any other value, with which the step fails. The function must
 * not call the library with the same model. */
typedef int (*emcon_solve_function)(void *user, int n_freedom, const double *du,
                                    const emcon_csr *second, int n_unknown, int n_column,
                                    double *columns);

/* A whole step from the displacements u0: emcon_begin_contact, then Newton's method with all
 * candidates (emcon_select_candidates, emcon_solve_contacts), until emcon_update_active is done.
 * `du`: the expected motion, on return that of the step; `stop`: that of emcon_begin_friction, in
 * dynamic steps with friction; `h`: the size of the step if pairs have damping, else 0. `active`: 1
 * for constraints that acted at the end of the step before, on return for those that act now;
 * `lam`: the forces of their gaps, 0 where open. After a failure `du` and `active` are what they
 * were; EMCON_ERROR_ANALYSIS: try a smaller step. */
int emcon_solve_step(emcon_model *model, int n_node, const double *u0 /* n_node x n_dim */,
                     double *du /* n_node x n_dim, in and out */,
                     const double *stop /* n_node x n_dim, or NULL */, double h, int n_constraint,
                     int *active /* n_constraint, in and out */, double *lam /* n_constraint */,
                     emcon_solve_function solve, void *user);

/* Leave selected constraints out for the rest of the step; `active`: those that remain. */
int emcon_drop(emcon_model *model, int n_redundant, const int *redundant /* n_redundant */,
               int n_constraint, int *active /* n_constraint */);

/* Areas on which the multipliers of the step to `u1` act, so that the pressure is lam/area; and the
 * lengths of slave surface that belong to them at its end, in space about the roots of the areas.
 * */
int emcon_get_areas(emcon_model *model, int n_node, const double *u1 /* n_node x n_dim */,
                    int n_constraint, double *area /* n_constraint */,
                    double *length /* n_constraint */);

/* The deepest overlap of bodies in a step, in edge lengths, computed from positions alone; and the
 * node that is inside, -1: none. Bodies are bounded by the surfaces of the pairs: if neither of two
 * surfaces closes around its body, no overlap is found. */
int emcon_overlap(emcon_model *model, int n_node, const double *u0 /* n_node x n_dim */,
                  const double *du /* n_node x n_dim */, double *depth, int *node);

/* ---- tables of options and laws -------------------------------------------------------------- */

/* Value number `i`, from 0, of all options of decks that are chosen by a word: its code; 1 if it is
 * the default; and in `text` six lines: the option, its word in decks, its name in this header, its
 * text in the log, the models that may have it (of "plane axial space"), and what to use for other
 * models. Lines 3, 4 and 6 may be empty. EMCON_ERROR_INPUT after the last value, and if an array is
 * NULL or `text` too short. */
int emcon_get_option(int i, int *code, int *is_default, int n_text, char *text /* n_text */);

/* Law number `i`, from 0: its code, and in `text` four lines: its name, its keyword and its
 * parameter in decks, and the names of its constants, separated by blanks. EMCON_ERROR_INPUT after
 * the last law, and if an array is NULL or `text` too short. */
int emcon_get_law(int i, int *code, int n_text, char *text /* n_text */);

/* ---- single kernels, for tests and for trying things out ------------------------------------- */

/* The law of this code, with its n constants, for a strain 11, 22, 2*12 that changes from `strain`
 * by `dstrain`: the energy at the end, the algorithmic stress S with S . dstrain = change of
 * energy, and its derivative with respect to the strain at the end. EMCON_ERROR_INPUT if there is
 * no such law, if it refuses the constants, or for NULL. */
int emcon_law_response(int law, int n, const double *constant /* n */,
                       const double *strain /* 3 */, const double *dstrain /* 3 */,
                       double *energy, double *stress /* 3 */, double *tangent /* 3 x 3 */);

/* Gap of a slave node over an edge. `x0` and `dx` are positions and motion of the slave node, of
 * the edge's start and end, and of the nodes before and after it (read only if `has_before`,
 * `has_after`); corners are rounded over a length `rounding`. `gap`: at the start, at the end, and
 * their difference; discrete gradient g, gradient at the end c, derivative h of g with respect to
 * the end. */
int emcon_node_gap(const double *x0 /* 5 x 2 */, const double *dx /* 5 x 2 */, int has_before,
                   int has_after, double rounding, double *gap /* 3 */, double *g /* 10 */,
                   double *c /* 10 */, double *h /* 10 x 10 */);

#ifdef __cplusplus
}
#endif

#endif
