/* A tie of a quadrilateral and a triangle below and two triangles above: its links by rows. In C and in C++. */
#include <emcon.h>
#include <stdio.h>

int main(void)
{
   const double x[] = {0, 0, 0, 2, 0, 0, 2, 2, 0, 0, 2, 0, 4, 1, 0,
                       .5, .5, 0, 1, .5, 0, .5, 1, 0, 2.5, 1.2, 0};
   const int kind[] = {9, 5}, offset[] = {4, 7}, lower[] = {0, 1, 2, 3, 1, 4, 2};
   const int kinds[] = {5, 5}, offsets[] = {3, 6}, upper[] = {5, 7, 6, 6, 7, 8};
   double moved[27];
   int master, slave, i, k, status;
   emcon_csr links;
   emcon_model *face = NULL;

   status = emcon_new(9, 3, x, &face);
   if (!status) status = emcon_add_faces(face, "below", 2, kind, offset, 7, lower, &master);
   if (!status) status = emcon_add_faces(face, "above", 2, kinds, offsets, 6, upper, &slave);
   if (!status) status = emcon_add_tie(face, slave, master, EMCON_DUAL, -1);
   if (!status) status = emcon_build(face);
   if (!status) status = emcon_links(face, &links);
   for (i = 0; i < 27; ++i) moved[i] = i < 15 ? x[(i/3)*3 + (i + 1)%3] - 2*x[i] : 0;
   if (!status) status = emcon_follow(face, 9, moved);
   if (status) printf("error: %s\n", emcon_message(face));
   for (i = 0; !status && i < links.n_row; ++i)
      for (k = links.row_start[i]; k < links.row_start[i + 1]; ++k)
         printf("%d %d %.17g\n", i, links.column[k], links.value[k]);
   for (i = 15; !status && i < 27; ++i) printf("%.17g\n", moved[i]);
   emcon_close(face);
   return status;
}
