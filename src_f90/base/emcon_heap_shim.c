/* What emcon_heap asks of the C library. */
#include <stdlib.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif

void emcon_heap_keep(void);
void emcon_heap_adapt(void);
double emcon_heap_in_use(void);

/* Blocks up to 32 MB come from the heap, and what is freed stays in it up to 64 MB. */
void emcon_heap_keep(void)
{
#ifdef __GLIBC__
   mallopt(M_MMAP_THRESHOLD, 32*1024*1024);
   mallopt(M_TRIM_THRESHOLD, 64*1024*1024);
#endif
}

/* The pointer is volatile, else the compiler leaves both calls out. */
void emcon_heap_adapt(void)
{
   void *volatile block = malloc(16*1024*1024);
   free(block);
}

/* Bytes in use, in the heap and in blocks of their own; 0: not known. */
double emcon_heap_in_use(void)
{
#if defined(__GLIBC__) && (__GLIBC__ > 2 || __GLIBC_MINOR__ >= 33)
   struct mallinfo2 heap = mallinfo2();
   return (double) heap.uordblks + (double) heap.hblkhd;
#else
   return 0.0;
#endif
}
