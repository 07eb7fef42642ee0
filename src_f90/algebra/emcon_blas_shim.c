/* A switch of the process that is out of Fortran's reach. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stddef.h>

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
