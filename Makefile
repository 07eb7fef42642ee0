# EMCON. `make help` lists what can be made.
#
# MODE=release|debug|sanitize|coverage, PRECISION=single|double|quad (of the state; matrices are double),
# LICENSE=permissive (without UMFPACK, which is under the GPL): a folder for each. The objects of both
# licences are the same but for two.
# V=1 shows commands, FFLAGS=... and CFLAGS=... are added to the flags below.
# Compiler and libraries are looked up once, by .ci/setup, into build/config.mk.

MODE ?= release
PRECISION ?= double
LICENSE ?= gpl
PREFIX ?= /usr/local
COMMON := build/$(MODE)$(if $(filter-out double,$(PRECISION)),-$(PRECISION))
BUILD := $(COMMON)$(if $(filter-out gpl,$(LICENSE)),-$(LICENSE))
O := $(COMMON)/obj
ifeq ($(filter $(MODE),release debug sanitize coverage),)
$(error MODE is release, debug, sanitize or coverage, not '$(MODE)')
endif
WP := $(patsubst single,real32,$(patsubst double,real64,$(patsubst quad,real128,$(PRECISION))))
ifeq ($(filter $(PRECISION),single double quad),)
$(error PRECISION is single, double or quad, not '$(PRECISION)')
endif
ifeq ($(filter gpl permissive,$(LICENSE)),)
$(error LICENSE is gpl or permissive, not '$(LICENSE)')
endif

# make has values of its own for these (f77, cc): `?=` would leave them.
ifeq ($(origin FC),default)
FC := gfortran
endif
ifeq ($(origin CC),default)
CC := gcc
endif
Q := $(if $(V),,@)
.DELETE_ON_ERROR:
.SUFFIXES:
.DEFAULT_GOAL := help
.PHONY: run test lib app pywrap kernels benches lint bench trade extremes soak soak-scenes sanitize coverage mutants processors docs install uninstall status clean \
	precisions help kernel_objects FORCE

# ---- set-up -------------------------------------------------------------------------------------

# Before anything else, unless build/config.mk was written on this machine: help and clean do
# without. What the caller sets in place of a search is handed on.
SETUP = FC='$(FC)' CC='$(CC)' $(foreach v,PYTHON HDF5_CFLAGS HDF5_LIBS UMFPACK_LIBS \
	MUMPS_CFLAGS MUMPS_LIBS ORDERING_LIBS LAPACK_LIBS,$(if $(findstring command,$(origin $v)),$v='$($v)')) .ci/setup
ifneq ($(filter-out help clean,$(MAKECMDGOALS)),)
$(shell $(SETUP) system >&2)
ifneq ($(.SHELLSTATUS),0)
$(error The set-up is not complete)
endif
include build/config.mk
endif

.venv/%.stamp: .ci/pins/%.txt build/config.mk
	@$(SETUP) python $*

build/site/tools/docs.stamp: .ci/pins/docs.txt build/config.mk
	@$(SETUP) tools

PY := .venv/bin/python
# The dense blocks are small here: threads inside BLAS would spin more than they work.
export OPENBLAS_NUM_THREADS ?= 1
unexport PYTHONHOME PYTHONPATH
# With it every process would compile the package anew, and every worker the tests.
unexport PYTHONDONTWRITEBYTECODE

# Two runs at a time take turns at building. Parallel, unless the caller has said how.
BUILDING = +@flock build/.lock $(MAKE) --no-print-directory $(if $(V),,--silent) \
	$(if $(findstring -j,$(MAKEFLAGS)),,-j$(shell nproc))

# ---- sources ------------------------------------------------------------------------------------

ROOMS := $(wildcard src_f90/*/)
LIB_SRC := $(wildcard $(addsuffix *.f90,$(filter-out %/app/,$(ROOMS))) \
	$(addsuffix *.F90,$(filter-out %/app/,$(ROOMS))))
LIB_C := $(wildcard $(addsuffix *.c,$(filter-out %/app/,$(ROOMS))))
BORDER := src_f90/border
MADE := $(if $(wildcard $(BORDER)/emcon.h),$(addprefix $(COMMON)/made/,emcon_c_types.f90 emcon_c.f90))
LIB_SRC += $(MADE)
APP_SRC := $(wildcard src_f90/app/*.f90)
APP_C := $(wildcard src_f90/app/*.c)
KERNEL_SRC := $(wildcard tests/kernels/*.f90 tests/kernels/*.F90)
SRC := $(LIB_SRC) $(APP_SRC) $(KERNEL_SRC)
ifeq ($(LICENSE),permissive)
UMFPACK_LIBS :=
GPL := %emcon_umfpack.f90 %test_umfpack.f90
LIB_SRC := $(filter-out $(GPL),$(LIB_SRC))
KERNEL_SRC := $(filter-out $(GPL),$(KERNEL_SRC))
# The sources that know of it.
KNOWING := $(O)/emcon_solver_kinds.o $(O)/main.o
endif
INC := $(wildcard $(addsuffix *.inc,$(ROOMS)))
vpath %.f90 $(ROOMS) tests/kernels $(COMMON)/made
vpath %.F90 $(ROOMS) tests/kernels
vpath %.c $(ROOMS)
objects = $(foreach o,$(addprefix $(O)/,$(addsuffix .o,$(basename $(notdir $(1))))),$(if \
	$(filter $(KNOWING),$(o)),$(BUILD)/obj/$(notdir $(o)),$(o)))
LIB_OBJ := $(call objects,$(LIB_SRC)) $(patsubst %,$(O)/%.o,$(notdir $(LIB_C)))
APP_OBJ := $(call objects,$(APP_SRC)) $(patsubst %,$(O)/%.o,$(notdir $(APP_C)))

# The C functions are made from the header and the procedures that they stand for: written only where
# they differ, so that an edit of a body makes none of them new.
$(MADE): $(COMMON)/made/stamp ; +@:
$(COMMON)/made/stamp: src_f90/make_c.py src_f90/c_header.py $(BORDER)/emcon.h \
		$(wildcard $(BORDER)/*.f90 src_f90/stepper/*.f90)
	@mkdir -p $(@D) && $(PYTHON) $< $(BORDER)/emcon.h $(@D) $(filter %.f90,$^) && touch $@

# ---- flags --------------------------------------------------------------------------------------

# From version 13 on, gfortran finalises structure constructors under -std=f2008, as that standard
# had it before its corrigendum; -std=f2018 does not.
# -frecursive: local arrays on the stack, so that models can run in threads of their own.
# -ffp-contract=off: no fused products, so that every machine gives the same bits.
# -g1: lines for backtraces; with where each variable is, -O2 compiles up to twice as long.
# -Wno-maybe-uninitialized: gfortran 12 warns falsely at automatic allocation.
# -Wno-compare-reals: exact comparisons here are meant.
# -Wno-unused-dummy-argument: an implementation of an abstract interface need not use all of it.
STD = $(if $(filter 12.%,$(COMPILER)),f2008,f2018)
FFLAGS_ALL = -std=$(STD) -fimplicit-none -pedantic -Wall -Wextra -Wno-maybe-uninitialized \
	-Wno-compare-reals -Wno-unused-dummy-argument -fPIC -frecursive -ffp-contract=off -DEMCON_WP=$(WP)
FFLAGS_release := -O2 -g1
FFLAGS_debug := -O0 -g -fcheck=all,no-array-temps -fbacktrace -ffpe-trap=invalid,zero,overflow \
	-finit-real=snan -finit-integer=-99999 -Wconversion
CFLAGS_ALL := -std=c99 -pedantic -Wall -Wextra -fPIC -g -ffp-contract=off
CFLAGS_release := -O2
CFLAGS_debug := -O0
# What is optimised away is not checked. null: gfortran hands an absent array on by loading its
# descriptor, which is harmless; the address sanitizer sees what is not.
SANITIZE := -fsanitize=address,undefined -fno-sanitize=null
# Fortran: no overflow of integers, as gfortran computes with the bounds of arrays that have none yet
# (where `a = b` gives a first value, or an absent one is handed on) and uses nothing of it.
FFLAGS_sanitize := -O0 -g1 $(SANITIZE) -fno-sanitize=signed-integer-overflow -fcheck=bounds,do,mem,pointer,recursion
CFLAGS_sanitize := -O0 -g1 $(SANITIZE)
# A libubsan that is shared writes to no file but standard error.
LDFLAGS_sanitize := $(SANITIZE) -static-libubsan
# Programs write at their end which lines they have run; of several at a time no count is lost.
FFLAGS_coverage := -O0 -g1 --coverage -fprofile-update=atomic
CFLAGS_coverage := -O0 -g1 --coverage -fprofile-update=atomic
LDFLAGS_coverage := --coverage
FCOMPILE = $(FC) $(FFLAGS_ALL) $(FFLAGS_$(MODE)) $(HDF5_CFLAGS) $(FFLAGS)
CCOMPILE = $(CC) $(CFLAGS_ALL) $(CFLAGS_$(MODE)) $(MUMPS_CFLAGS) $(CFLAGS)
# The vector unit of the loops over elements side by side: that of this machine's level, up to AVX2.
# VECTOR= builds for all machines, -march=native -mprefer-vector-width=512 takes AVX-512 where it is.
VECTOR ?= $(if $(shell grep -m1 -o -w avx2 /proc/cpuinfo 2> /dev/null),-march=x86-64-v3)
LIBS = $(HDF5_LIBS) $(UMFPACK_LIBS) $(MUMPS_LIBS) $(ORDERING_LIBS) $(LAPACK_LIBS)
# Of the compiler: threads.
THREAD_LIBS := -lgomp
# Programs: HDF5 from its archives where .ci/setup has found them, unless the caller names another. BLAS
# first: most of what is looked up at a start is its own kernels. And last, for archives that call it.
APP_LIBS = $(LAPACK_LIBS) $(if $(filter file,$(origin HDF5_LIBS)),$(HDF5_APP_LIBS),$(HDF5_LIBS)) \
	$(UMFPACK_LIBS) $(MUMPS_LIBS) $(ORDERING_LIBS) $(LAPACK_LIBS) $(THREAD_LIBS)

# Flags of a release by the build tags of sources, `! build: lanes`: module_order.py reads them.

# What holds whole models and computes nothing: optimising how those are freed takes half of the
# time of the library.
FFLAGS_OF_holder := -O0 -g1

# Sources without a tag in rooms that read decks, write results and hand calls on (module_order.py
# names them): nothing in them is repeated for each element or contact. They take a third less of
# the time to compile than by -O2.
# -Wno-uninitialized: by -O1 gfortran 12 warns falsely of functions of arrays too.
FFLAGS_OF_outer := -O1 -g1 -Wno-uninitialized

# Loops over points side by side: a law in numbers that the compiler takes apart, so that it sees the
# whole of it at once. No sum over lanes, no fused product: with any VECTOR=... the bits are the same.
FFLAGS_OF_lanes := -O3 -g1 -fopenmp-simd -fno-trapping-math \
	-fno-semantic-interposition -Wno-unused-function -finline-limit=1000000 \
	$(addprefix --param ,inline-unit-growth=100000 large-function-growth=1000000 \
	large-stack-frame=1000000 max-completely-peel-times=32 max-completely-peeled-insns=2000 \
	sra-max-propagations=1000 sra-max-scalarization-size-Ospeed=2000) $(VECTOR)

# Loops over all unknowns in each correction, several at a time: the bits are the same here too.
FFLAGS_OF_streams := -O3 -g1 -fopenmp-simd $(VECTOR)

# One element at a time, by arrays of its size: these are on the stack.
FFLAGS_OF_elements := -O3 -g1 -fstack-arrays $(VECTOR)

# Numbers with many derivatives, added and multiplied term by term: several terms at a time.
# -Wno-zerotrip: those without second derivatives have loops over none.
FFLAGS_OF_derivatives := -O3 -g1 -Wno-zerotrip $(VECTOR)
# Loops over eight of them are vectors of the unit's length only if nobody unrolls them before.
FFLAGS_OF_eight := $(FFLAGS_OF_derivatives) --param max-completely-peel-times=3

TAGS := $(sort $(patsubst FFLAGS_OF_%,%,$(filter FFLAGS_OF_%,$(.VARIABLES))))

# Kept beside the objects, and written only where they differ: what stands on them is made anew.
# Read by cat: $(file <...) of GNU make 4.3 loses text when its buffer has to grow.
ifdef COMPILER
$(shell mkdir -p $(O) $(COMMON)/mod $(BUILD)/obj)
define stored
ifneq ($$(shell cat $(1) 2> /dev/null),$$(strip $$($(2))))
$$(file >$(1),$$(strip $$($(2))))
endif
endef
FLAGS := $(COMPILER) $(FCOMPILE) $(VECTOR) $(CCOMPILE)
READ := $(SRC) $(INC)
$(eval $(call stored,$(COMMON)/flags.txt,FLAGS))
$(eval $(call stored,$(COMMON)/sources.txt,READ))
$(eval $(call stored,$(BUILD)/libs.txt,APP_LIBS))
$(foreach tag,$(TAGS),$(eval $(call stored,$(COMMON)/flags_$(tag).txt,FFLAGS_OF_$(tag))))

$(COMMON)/order.mk: src_f90/module_order.py $(SRC) $(INC) $(COMMON)/sources.txt Makefile
	@$(PYTHON) $< $(O) $(COMMON)/mod '$(TAGS)' $(SRC) > $@.$$$$ && mv $@.$$$$ $@
include $(COMMON)/order.mk
-include $(wildcard $(O)/*.d)
endif

# ---- library, program, kernel tests -------------------------------------------------------------

$(O)/%.o: %.f90 $(COMMON)/flags.txt
	@echo "  FC    $<"
	$(Q)$(FCOMPILE) -J$(COMMON)/mod -c $< -o $@

$(O)/%.o: %.F90 $(COMMON)/flags.txt
	@echo "  FC    $<"
	$(Q)$(FCOMPILE) -J$(COMMON)/mod -c $< -o $@

# Behind the one of the other licence: by then there are the modules that it uses.
ifdef KNOWING
$(BUILD)/obj/%.o: %.F90 $(O)/%.o
	@echo "  FC    $<"
	$(Q)$(FCOMPILE) -DEMCON_PERMISSIVE -I$(COMMON)/mod -J$(BUILD)/obj -c $< -o $@
endif

$(O)/%.c.o: %.c $(COMMON)/flags.txt
	@echo "  CC    $<"
	$(Q)$(CCOMPILE) -MMD -MP -c $< -o $@

VERSION := $(shell sed -n 's/^version = "\(.*\)"/\1/p' pyproject.toml)
# Programs run with libraries of their own major version, as long as that is 0 of their minor one.
SHARED := libemcon.so.$(shell echo $(VERSION) | sed 's/^\(0\.[0-9]*\|[1-9][0-9]*\)\..*/\1/')

$(BUILD)/libemcon.a: $(LIB_OBJ)
	@echo "  AR    $@"
	$(Q)rm -f $@ && ar rcs $@ $^

# The library shows what the headers declare and the modules hold, and nothing else; that with the
# sanitizers in it also what they call each other by.
COMMA := ,
SYMBOLS := $(COMMON)/made/symbols.map
ifneq ($(MADE),)
SHOWN := $(if $(filter-out sanitize coverage,$(MODE)),-Wl$(COMMA)--version-script=$(SYMBOLS))
endif
$(SYMBOLS): src_f90/make_symbols.py src_f90/c_header.py $(BORDER)/emcon.h
	@mkdir -p $(@D)
	$(Q)$(PYTHON) $< $(BORDER)/emcon.h > $@

$(BUILD)/$(SHARED): $(LIB_OBJ) $(if $(MADE),$(SYMBOLS)) $(BUILD)/libs.txt
	@echo "  LINK  $@"
	$(Q)$(FC) $(LDFLAGS_$(MODE)) -shared -Wl,-soname,$(@F) -Wl,--no-undefined -o $@ $(LIB_OBJ) \
		$(SHOWN) $(LIBS) $(THREAD_LIBS)
	$(Q)ln -sf $(@F) $(BUILD)/libemcon.so

$(BUILD)/emcon: $(APP_OBJ) $(BUILD)/libemcon.a $(BUILD)/libs.txt
	@echo "  LINK  $@"
	$(Q)$(FC) $(LDFLAGS_$(MODE)) -o $@ $(filter %.o %.a,$^) $(APP_LIBS)

# `private`: what is made on the way keeps its own flags.
$(TAGGED_threads:%=$(O)/%.o): private FFLAGS_ALL += -fopenmp
define tagged
$$(TAGGED_$(1):%=$(O)/%.o): $(COMMON)/flags_$(1).txt
$$(TAGGED_$(1):%=$(O)/%.o): private FFLAGS_release := $$(FFLAGS_OF_$(1))
endef
$(foreach tag,$(TAGS),$(eval $(call tagged,$(tag))))

# The kernel tests are compiled once, with all checks: those of `debug` are these with its library.
KERNEL_OBJ := $(call objects,$(KERNEL_SRC))
$(KERNEL_OBJ): private FFLAGS_release := $(FFLAGS_debug)
kernel_objects: $(KERNEL_OBJ)

ifeq ($(MODE),debug)
KERNEL_OBJ := $(KERNEL_OBJ:build/debug%=build/release%)
$(KERNEL_OBJ) &: FORCE
	+$(Q)$(MAKE) --no-print-directory MODE=release kernel_objects
FORCE:
endif

$(BUILD)/kernels: $(KERNEL_OBJ) $(BUILD)/libemcon.a $(BUILD)/libs.txt
	@echo "  LINK  $@"
	$(Q)$(FC) $(LDFLAGS_$(MODE)) -o $@ $(filter %.o %.a,$^) $(APP_LIBS)

lib: $(BUILD)/libemcon.a $(BUILD)/$(SHARED)  ## the library, build/release/libemcon.{a,so}
app: $(BUILD)/emcon  ## the program, build/release/emcon
# One program per file, timed, not tested; those without `bench_` are called by scripts.
BENCHES := $(patsubst tests/bench/%.f90,$(BUILD)/%,$(wildcard tests/bench/*.f90))
$(BENCHES): $(BUILD)/%: tests/bench/%.f90 $(BUILD)/libemcon.a
	@echo "  FC    $<"
	$(Q)$(FCOMPILE) -I$(COMMON)/mod -o $@ $^ $(LIBS) $(THREAD_LIBS)

benches: $(BENCHES)  ## the programs of tests/bench
kernels: $(BUILD)/kernels  ## the program of the kernel tests, build/release/kernels [SUITE [TEST]]

# ---- what others find the library by ------------------------------------------------------------

BLANK := $() $()
COMPANIONS := emcon.pc emcon-static.pc emconConfig.cmake emconConfigVersion.cmake
UP := ../../..
LIB := lib
INCLUDE := include/emcon
ALL_LIBS = $(strip $(LIBS) $(THREAD_LIBS))
# fill FILE FOLDER: FILE.in of the border with what it is to hold, into FOLDER.
fill = sed -e 's|@VERSION@|$(VERSION)|' -e 's|@SHARED@|$(SHARED)|' -e 's|@UP@|$(UP)|' \
	-e 's|@LIB@|$(LIB)|' -e 's|@INCLUDE@|$(INCLUDE)|' -e 's|@LDFLAGS@|$(LDFLAGS_$(MODE))|' \
	-e 's|@LIBS@|$(ALL_LIBS)|' -e 's|@LIST@|$(subst $(BLANK),;,$(ALL_LIBS))|' \
	$(BORDER)/$(1).in > $(2)/$(1)

# ---- Python extension ---------------------------------------------------------------------------

# f2py writes the wrapper, the rules below compile it: the same way for every version of Python.
# For the interpreter that pip runs in, pywrap/setup.py sets PY, PY_READY (what must have been made
# for it: nothing), PYTHON_INCLUDE and EXT_SUFFIX, and gives folders of its own as P and PACKAGE.
PY_READY := .venv/run.stamp
P := $(BUILD)/py
PACKAGE := pywrap/emcon
HEADER := $(BORDER)/emcon.h

# What C has is what Python calls: the signatures are made from the header.
$(P)/_core.pyf: pywrap/make_pyf.py src_f90/c_header.py $(HEADER) $(PY_READY)
	@echo "  PYF   $(HEADER)"
	$(Q)mkdir -p $(P)
	$(Q)$(PY) $< $(HEADER) > $@

$(P)/_coremodule.c $(P)/fortranobject.c $(P)/include.txt &: $(P)/_core.pyf
	@echo "  F2PY  $<"
	$(Q)$(PY) -m numpy.f2py $< --build-dir $(P) > $(P)/f2py.log 2>&1 \
		|| { cat $(P)/f2py.log; exit 1; }
	$(Q)cp $$($(PY) -c 'import numpy.f2py as f; print(f.get_include())')/fortranobject.[ch] $(P)
	$(Q)$(PY) -c 'import numpy; print("-I" + numpy.get_include())' > $(P)/include.txt

$(PYTHON_INCLUDE)/Python.h:
	@echo "$(PY) cannot be extended: $@ is missing (python3-dev of Debian holds it)" >&2; exit 1

$(P)/%.o: $(P)/%.c $(P)/include.txt $(PYTHON_INCLUDE)/Python.h $(COMMON)/flags.txt
	@echo "  CC    $<"
	$(Q)$(CC) -O1 -g1 -fPIC -I$(PYTHON_INCLUDE) -I$(BORDER) @$(P)/include.txt $(CFLAGS) -c $< -o $@

$(P)/_core$(EXT_SUFFIX): $(addprefix $(P)/,_coremodule.o fortranobject.o) $(BUILD)/$(SHARED)
	@echo "  LINK  $@"
	$(Q)$(CC) -shared -o $@ $^ -Wl,-rpath,'$$ORIGIN'

# The package holds the extension of the mode made last. `install` replaces a file, where `cp`
# would write into one that a running Python has mapped.
ifneq ($(PRECISION),double)
ifneq ($(filter pywrap run,$(MAKECMDGOALS)),)
$(error Python and C see double: pywrap is for PRECISION=double; app, lib and kernels are for all)
endif
endif
# The program of the package, with its library beside it.
$(P)/emcon: $(APP_OBJ) $(BUILD)/$(SHARED)
	@echo "  LINK  $@"
	$(Q)mkdir -p $(P) && $(FC) $(LDFLAGS_$(MODE)) -o $@ $^ $(THREAD_LIBS) -Wl,-rpath,'$$ORIGIN/..'

pywrap: $(P)/_core$(EXT_SUFFIX) $(P)/emcon  ## the Python package, used as .venv/bin/python -m emcon
	$(Q)find '$(PACKAGE)' -name 'libemcon.so.*' ! -name $(SHARED) -delete
	$(Q)install -d '$(PACKAGE)/bin' '$(PACKAGE)/include' '$(PACKAGE)/cmake'
	$(Q)for f in $< $(BUILD)/$(SHARED); do \
		cmp -s $$f '$(PACKAGE)'/$${f##*/} || install -m 755 $$f '$(PACKAGE)'; done
	$(Q)cmp -s $(P)/emcon '$(PACKAGE)/bin/emcon' || install -m 755 $(P)/emcon '$(PACKAGE)/bin'
	$(Q)install -m 644 $(BORDER)/emcon.h $(BORDER)/emcon.hpp '$(PACKAGE)/include'
	$(Q)$(foreach file,$(filter %.cmake,$(COMPANIONS)),$(call fill,$(file),'$(PACKAGE)/cmake') &&) :
pywrap: UP := ..
pywrap: LIB := .
pywrap: INCLUDE := include

# ---- use ----------------------------------------------------------------------------------------

run:  ## set up, build, run the ring impact, draw build/run/ring.png
	$(BUILDING) app pywrap
	@$(BUILD)/emcon input_decks/ring.inp --output build/run
	@$(PY) -m emcon plot build/run/ring.vtkhdf
	@$(PY) -m emcon summary build/run/ring

test:  ## set up, build, run all tests; ORDER=17: in the order that this number draws
	$(BUILDING) MODE=release PRECISION=double .venv/test.stamp app lib pywrap kernels
	$(BUILDING) MODE=debug PRECISION=double kernels
	@$(PY) -m pytest -n $(shell nproc) $(if $(ORDER),--order=$(ORDER)) tests

# OpenBLAS has kernels for each kind of processor, which round differently: their names, and what a
# processor needs to run them.
BLAS_KERNELS := Nehalem:sse4_2 Sandybridge:avx Haswell:avx2 Zen:avx2 SkylakeX:avx512f
has = $(shell grep -m1 -o -w $(lastword $(subst :, ,$(1))) /proc/cpuinfo 2> /dev/null)
processors: .venv/test.stamp  ## run the tests of scenes, hosts and decks with BLAS kernels of other processors
	$(BUILDING) MODE=release PRECISION=double app lib pywrap kernels
	@set -e; for kernel in $(foreach k,$(BLAS_KERNELS),$(if $(call has,$k),$(firstword $(subst :, ,$k)))); do \
		echo "$$kernel"; OPENBLAS_CORETYPE=$$kernel $(PY) -m pytest -q -n $(shell nproc) \
		tests/scenes tests/embed tests/decks; done

precisions: .venv/test.stamp  ## build single and quad, run the kernel tests and decks of all three
	$(BUILDING) MODE=release PRECISION=double app kernels
	$(BUILDING) MODE=release PRECISION=single app kernels
	$(BUILDING) MODE=release PRECISION=quad app kernels
	@set -e; for folder in release release-single release-quad; do build/$$folder/kernels; done
	@$(PY) -m pytest -q tests/extremes/test_precision.py

lint: .venv/lint.stamp  ## check the Fortran sources against the written rules
	.venv/bin/fortitude check src_f90 tests/kernels tests/bench
	.venv/bin/fortitude check --preview --select no-real-suffix src_f90 tests/kernels tests/bench

bench:  ## print the timed scenes of tests/bench; fail where the program does more than was stored
	$(BUILDING) app lib pywrap $(BENCHES)
	@set -e; for program in $(filter %/bench_%,$(BENCHES)); do $$program; done
	@set -e; for script in tests/bench/bench_*.py; do $(PY) $$script; done

trade: .venv/test.stamp  ## write the tables and the figure of docs/trade.md anew
	$(BUILDING) MODE=release PRECISION=double app
	$(BUILDING) MODE=release PRECISION=single app
	$(PY) tests/bench/trade.py --update
	$(PY) tests/bench/trade_knobs.py --update
	$(PY) tests/bench/trade_kinds.py --update
	$(PY) tests/bench/trade_friction.py --update
	$(PY) tests/bench/trade_first.py --update
	$(PY) tests/bench/trade_coarse.py --update
	$(PY) tests/bench/trade_fine.py --update
	$(PY) tests/bench/trade_discs.py --update
	$(PY) tests/bench/trade_studies.py --update

extremes: .venv/test.stamp  ## drive everything to its extremes; write the table of docs/stability.md anew
	$(BUILDING) app pywrap
	$(PY) tests/bench/extremes.py --update

SECONDS ?= 600
soak: .venv/test.stamp  ## seeded fuzzers, SECONDS=600: decks, damaged files, calls, kills; threads; long tests
	$(BUILDING) app lib kernels
	@EMCON_TEST_CASES=10000 $(BUILD)/kernels contact_problem
	@$(PY) tests/soak/soak.py --seconds $(SECONDS)
	@EMCON_OPENS=20000 $(PY) -m pytest -q tests/embed/test_threads.py
	@$(PY) -m pytest -q -n $(shell nproc) --long -m long tests

SEEDS ?= 1 500
soak-scenes: .venv/test.stamp  ## drawn scenes, SEEDS="1 500": verdicts beside a judge by fields
	$(BUILDING) app
	@$(PY) tests/soak/scene_table.py --seeds $(SEEDS)
	@$(PY) tests/soak/space_scenes.py
	@$(PY) tests/soak/space_crowds.py

sanitize: .venv/test.stamp  ## build and run under the address and undefined-behaviour sanitizers
	$(BUILDING) MODE=sanitize PRECISION=double app lib kernels
	@$(PY) tests/soak/sanitize.py

coverage: .venv/test.stamp  ## print the lines of each folder that the kernel tests run, and which they do not
	$(BUILDING) MODE=coverage PRECISION=double app kernels
	@$(PY) tests/soak/kernel_coverage.py

COUNT ?= 80
mutants: .venv/test.stamp  ## change COUNT=80 lines of the numerics, one at a time: does a test notice?
	$(BUILDING) MODE=release PRECISION=double lib app kernels pywrap
	@$(PY) tests/soak/mutants.py --count $(COUNT)

docs: .venv/run.stamp build/site/tools/docs.stamp  ## the site, build/site/html/index.html: gallery, references, all pages
	$(BUILDING) MODE=release PRECISION=double app pywrap
	@$(PY) docs/site/build.py --sphinx build/site/tools/bin/python

# Prefixes may have blanks in their names; what is installed finds its parts from where it stands.
TO = $(DESTDIR)$(PREFIX)
install: app lib  ## program, library, headers, modules, man page, for CMake and pkg-config, below PREFIX=
	$(Q)install -d '$(TO)/bin' '$(TO)/lib/pkgconfig' '$(TO)/lib/cmake/emcon' '$(TO)/include/emcon' \
		'$(TO)/share/man/man1' '$(TO)/share/doc/emcon'
	$(Q)install -m 755 $(BUILD)/emcon '$(TO)/bin'
	$(Q)install -m 755 $(BUILD)/$(SHARED) '$(TO)/lib'
	$(Q)ln -sf $(SHARED) '$(TO)/lib/libemcon.so'
	$(Q)install -m 644 $(BUILD)/libemcon.a '$(TO)/lib'
	$(Q)install -m 644 $(patsubst %,$(COMMON)/mod/%.mod,$(filter $(MODULES),$(basename $(notdir $(LIB_SRC))))) \
		$(BORDER)/emcon.h $(BORDER)/emcon.hpp '$(TO)/include/emcon'
	$(Q)$(foreach file,$(filter %.pc,$(COMPANIONS)),$(call fill,$(file),'$(TO)/lib/pkgconfig') &&) :
	$(Q)$(foreach file,$(filter %.cmake,$(COMPANIONS)),$(call fill,$(file),'$(TO)/lib/cmake/emcon') &&) :
	$(Q)install -m 644 docs/emcon.1 '$(TO)/share/man/man1'
	$(Q)install -m 644 LICENSE '$(TO)/share/doc/emcon'

uninstall:  ## take away what `make install` has put below PREFIX=
	$(Q)rm -f '$(TO)/bin/emcon' '$(TO)'/lib/libemcon.so* '$(TO)/lib/libemcon.a' \
		'$(TO)'/include/emcon/emcon*.mod '$(TO)/include/emcon/emcon.h' '$(TO)/include/emcon/emcon.hpp' \
		'$(TO)/lib/pkgconfig/emcon.pc' '$(TO)/lib/pkgconfig/emcon-static.pc' \
		'$(TO)'/lib/cmake/emcon/emconConfig*.cmake '$(TO)/share/man/man1/emcon.1' \
		'$(TO)/share/doc/emcon/LICENSE'
	$(Q)for folder in include/emcon lib/cmake/emcon share/doc/emcon; do \
		[ ! -d '$(TO)'/$$folder ] || rmdir --ignore-fail-on-non-empty '$(TO)'/$$folder; done

status:  ## compiler, libraries and Python packages that were found
	@$(SETUP) status

clean:  ## remove build/ and the compiled extension (.venv stays)
	rm -rf build pywrap/emcon/_core*.so pywrap/emcon/libemcon.so.* $(addprefix pywrap/emcon/,bin include cmake)

help:  ## this list
	@sed -n 's/^\([a-z]*\):.*  ## /\1\t/p' $(MAKEFILE_LIST) | while IFS='	' read -r name text; do \
		printf '  make %-10s %s\n' "$$name" "$$text"; done
