/* Which lines of a program a run passes: line_trace PLACES OUT PROGRAM ARGUMENTS...
 *
 * PLACES holds addresses as the linker has given them, in rising order, each with the number of its
 * line from 0 on, eight bytes each. At an address the first byte of the instruction becomes a
 * breakpoint; as one is met all of its line are taken away: the program runs at its own speed but
 * for the first time in a line. One line is added to OUT: what the variable
 * PYTEST_CURRENT_TEST says, the processor time in seconds and a bit for each line, in hexadecimal.
 * The exit code is that of the program; signals are handed on to it. For x86-64 under Linux. */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/user.h>
#include <sys/wait.h>
#include <unistd.h>

enum { BREAK = 0xcc };

static pid_t child;

struct places {
	size_t count, lines;
	uint64_t *address;	/* rising */
	uint64_t *line;
	size_t *next;		/* the next one of the line, around */
	unsigned char *byte;	/* what stood there */
	unsigned char *is_met;	/* (lines) */
};

static void fail(const char *what)
{
	perror(what);
	if (child > 0)
		kill(child, SIGKILL);
	exit(125);
}

static void hand_on(int number)
{
	kill(child, number);
}

static struct places read_places(const char *name)
{
	struct places p = {0};
	struct stat about;
	uint64_t *pair;
	size_t k, *last;
	FILE *file = fopen(name, "rb");

	if (!file || fstat(fileno(file), &about))
		fail(name);
	p.count = (size_t)about.st_size/(2*sizeof(uint64_t));
	pair = malloc(2*p.count*sizeof *pair + 1);
	p.address = malloc(p.count*sizeof *p.address + 1);
	p.line = malloc(p.count*sizeof *p.line + 1);
	p.next = malloc(p.count*sizeof *p.next + 1);
	p.byte = calloc(p.count + 1, 1);
	if (!pair || !p.address || !p.line || !p.next || !p.byte
	    || fread(pair, 2*sizeof *pair, p.count, file) != p.count)
		fail(name);
	fclose(file);
	for (k = 0; k < p.count; k++) {
		p.address[k] = pair[2*k];
		p.line[k] = pair[2*k + 1];
		if (p.line[k] >= p.lines)
			p.lines = p.line[k] + 1;
	}
	free(pair);
	p.is_met = calloc(p.lines + 1, 1);
	last = malloc(p.lines*sizeof *last + 1);
	if (!p.is_met || !last)
		fail(name);
	for (k = 0; k < p.lines; k++)
		last[k] = p.count;
	for (k = 0; k < p.count; k++) {
		size_t *before = &last[p.line[k]];
		p.next[k] = *before < p.count ? p.next[*before] : k;
		if (*before < p.count)
			p.next[*before] = k;
		*before = k;
	}
	free(last);
	return p;
}

/* Where the program was put: the lowest address that its file is mapped to. */
static uint64_t base_of(pid_t pid, const char *program)
{
	char name[64], line[4096 + 128];
	char *path = realpath(program, NULL);
	uint64_t base = 0;
	FILE *file;

	snprintf(name, sizeof name, "/proc/%d/maps", (int)pid);
	file = fopen(name, "r");
	if (!file || !path)
		fail(program);
	while (!base && fgets(line, sizeof line, file))
		if (strstr(line, path))
			base = strtoull(line, NULL, 16);
	fclose(file);
	free(path);
	return base;
}

/* Breakpoints at all places, in one piece of memory. */
static void plant(struct places *p, uint64_t base, int memory)
{
	uint64_t first, length;
	unsigned char *text;
	size_t k;

	if (p->count == 0)
		return;
	first = base + p->address[0];
	length = p->address[p->count - 1] - p->address[0] + 1;
	text = malloc(length);
	if (!text || pread(memory, text, length, (off_t)first) != (ssize_t)length)
		fail("reading the program");
	for (k = 0; k < p->count; k++) {
		unsigned char *here = text + (p->address[k] - p->address[0]);
		p->byte[k] = *here;
		*here = BREAK;
	}
	if (pwrite(memory, text, length, (off_t)first) != (ssize_t)length)
		fail("writing breakpoints");
	free(text);
}

static size_t find(const struct places *p, uint64_t address)
{
	size_t low = 0, high = p->count;

	while (low < high) {
		size_t middle = low + (high - low)/2;
		if (p->address[middle] < address)
			low = middle + 1;
		else
			high = middle;
	}
	return low < p->count && p->address[low] == address ? low : p->count;
}

/* Has a thread met a breakpoint? It goes on with the instruction that stood there. */
static int is_at_place(struct places *p, uint64_t base, int memory, pid_t thread)
{
	size_t at = offsetof(struct user, regs.rip);
	uint64_t after = (uint64_t)ptrace(PTRACE_PEEKUSER, thread, at, NULL);
	size_t k = find(p, after - 1 - base), j = k;

	if (k == p->count)
		return 0;
	if (!p->is_met[p->line[k]])
		do {
			if (pwrite(memory, &p->byte[j], 1, (off_t)(base + p->address[j])) != 1)
				fail("taking a breakpoint away");
			j = p->next[j];
		} while (j != k);
	p->is_met[p->line[k]] = 1;
	return ptrace(PTRACE_POKEUSER, thread, at, after - 1) == 0;
}

static void report(const struct places *p, const char *name, const struct rusage *used)
{
	const char *test = getenv("PYTEST_CURRENT_TEST");
	size_t k, room = 2*(p->lines/8 + 1) + strlen(test ? test : "") + 64;
	char *text = malloc(room);
	int n, file = open(name, O_WRONLY | O_CREAT | O_APPEND, 0666);

	if (!text || file < 0)
		fail(name);
	n = sprintf(text, "%s\t%.3f\t", test ? test : "",
		    (double)(used->ru_utime.tv_sec + used->ru_stime.tv_sec)
		    + 1e-6*(double)(used->ru_utime.tv_usec + used->ru_stime.tv_usec));
	for (k = 0; k < p->lines; k += 4) {
		unsigned bits = 0, j;
		for (j = 0; j < 4 && k + j < p->lines; j++)
			bits |= (unsigned)p->is_met[k + j] << j;
		text[n++] = "0123456789abcdef"[bits];
	}
	text[n++] = '\n';
	if (write(file, text, (size_t)n) != n)
		fail(name);
	close(file);
}

/* Until the program ends: its status. */
static int follow(struct places *p, uint64_t base, int memory, struct rusage *used)
{
	for (;;) {
		int status, signal_number;
		pid_t thread = wait4(-1, &status, __WALL, used);

		if (thread < 0 && errno == EINTR)
			continue;
		if (thread < 0)
			fail("wait");
		if (!WIFSTOPPED(status)) {
			if (thread == child)
				return status;
			continue;
		}
		signal_number = WSTOPSIG(status);
		/* A thread begins with a stop of its own. */
		if (status >> 16 || (signal_number == SIGSTOP && thread != child)
		    || (signal_number == SIGTRAP && is_at_place(p, base, memory, thread)))
			signal_number = 0;
		ptrace(PTRACE_CONT, thread, NULL, (long)signal_number);
	}
}

int main(int argc, char **argv)
{
	static const int handed[] = {SIGINT, SIGTERM, SIGHUP};
	struct places p;
	struct rusage used;
	uint64_t base;
	char name[64];
	int status, memory;
	size_t k;

	if (argc < 4) {
		fprintf(stderr, "line_trace PLACES OUT PROGRAM ARGUMENTS...\n");
		return 125;
	}
	p = read_places(argv[1]);
	child = fork();
	if (child == 0) {
		if (ptrace(PTRACE_TRACEME, 0, NULL, NULL) == 0)
			execv(argv[3], argv + 3);
		_exit(125);
	}
	if (waitpid(child, &status, 0) != child || !WIFSTOPPED(status))
		fail(argv[3]);
	ptrace(PTRACE_SETOPTIONS, child, NULL, (long)(PTRACE_O_EXITKILL | PTRACE_O_TRACECLONE));
	for (k = 0; k < sizeof handed/sizeof *handed; k++)
		signal(handed[k], hand_on);
	base = base_of(child, argv[3]);
	snprintf(name, sizeof name, "/proc/%d/mem", (int)child);
	memory = open(name, O_RDWR);
	if (memory < 0)
		fail(name);
	plant(&p, base, memory);
	ptrace(PTRACE_CONT, child, NULL, 0L);
	status = follow(&p, base, memory, &used);
	report(&p, argv[2], &used);
	if (WIFSIGNALED(status)) {
		signal(WTERMSIG(status), SIG_DFL);
		raise(WTERMSIG(status));
	}
	return WEXITSTATUS(status);
}
