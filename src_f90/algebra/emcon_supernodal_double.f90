! build: streams
!> Cholesky factors by dense blocks in double precision: for solutions to round-off, and for what
!> single precision is too coarse for.
module emcon_supernodal_double
   use, intrinsic :: iso_fortran_env, only : kp => real64
   use, intrinsic :: ieee_arithmetic, only : ieee_get_underflow_mode, ieee_set_underflow_mode, &
      ieee_support_underflow_control
   use emcon_blas, only : blas_enter_alone, blas_leave_alone, ieee_status_type
   use emcon_blocks_lapack, only : dgemm, dtrmm, potrf => dpotrf, syrk => dsyrk, &
      trsm => dtrsm, trtri => dtrtri
   use emcon_csr, only : csr_t
   use emcon_kinds, only : dp, int64
   use emcon_row_panels, only : row_panel_t
   use emcon_supernodes, only : n_lane, n_side, packed_size, supernodes_t
   implicit none
   private
   include "emcon_supernodal_use.inc"

contains

   include "emcon_supernodal_factor.inc"
   include "emcon_supernodal_solve.inc"
   include "emcon_supernodal_rows.inc"

end module emcon_supernodal_double
