/* A switch and a name of the process that are out of Fortran's reach. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stddef.h>
#include <string.h>

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

/* How many threads it runs; 1 of other libraries. */
int emcon_blas_get_threads(void)
{
   int (*get_threads)(void);
   *(void **)(&get_threads) = dlsym(RTLD_DEFAULT, "openblas_get_num_threads");
   return get_threads == NULL ? 1 : get_threads();
}

/* What OpenBLAS says of itself, the kernels that it chose for this processor among it; "" of other
   libraries. At most n - 1 letters and a zero. */
void emcon_blas_name(int n, char *name)
{
   char *(*config)(void);
   size_t length;
   name[0] = '\0';
   *(void **)(&config) = dlsym(RTLD_DEFAULT, "openblas_get_config");
   if (config == NULL) return;
   length = strlen(config());
   if (length > (size_t)n - 1) length = (size_t)n - 1;
   memcpy(name, config(), length);
   name[length] = '\0';
}
