/* Two switches of the process that are out of Fortran's reach. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stddef.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif

/* OpenBLAS runs its own threads; its switch is a function that other BLAS libraries lack, so it
   is looked up at run time. 1 if it was there, 0 if not. */
int emcon_blas_set_threads(int n)
{
   void (*set_threads)(int);
   *(void **)(&set_threads) = dlsym(RTLD_DEFAULT, "openblas_set_num_threads");
   if (set_threads == NULL) return 0;
   set_threads(n);
   return 1;
}

/* Blocks up to 32 MB come from the heap, and what is freed stays in it up to 64 MB. */
void emcon_blas_keep_memory(void)
{
#ifdef __GLIBC__
   mallopt(M_MMAP_THRESHOLD, 32*1024*1024);
   mallopt(M_TRIM_THRESHOLD, 64*1024*1024);
#endif
}
