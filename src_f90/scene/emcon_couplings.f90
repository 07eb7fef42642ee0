!> Linear conditions on displacements: ties between meshes, equations.
module emcon_couplings
   use emcon_interactions, only : multiplier_dual
   use emcon_kinds, only : wp
   use emcon_origin, only : origin_t
   use emcon_tie_maps, only : tie_map_t
   implicit none
   private
   public :: tie_t, tie_rows_t, equation_t

   !> The constraints of a tie: for row k, in either direction, the sum of weight times position
   !> over its entries is zero. Row k belongs to the multiplier psi_k of slave node k: the entries
   !> are D_kB = int psi_k N_B for slave nodes and -M_kC = -int psi_k N_C for master nodes.
   type :: tie_rows_t
      integer, allocatable :: slave(:)               !! (n) slave nodes, in the plane in turn
      !> Of the plane: (2, n) row before and after; 0: an end
      integer, allocatable :: neighbour(:, :)
      integer, allocatable :: start(:)               !! (n + 1) entries before each row, from 0
      integer, allocatable :: node(:)                !! entries; the first is the slave node
      real(wp), allocatable :: weight(:)             !! [L^(n_dim - 1)]; those of a row sum up to 0
      !> Entries of the image of a node; only with a map
      logical, allocatable :: is_image(:)
      real(wp), allocatable :: size(:)               !! (n) int psi_k, > 0 [L^(n_dim - 1)]
      integer, allocatable :: covered(:, :)          !! (most nodes, any) master facets all covered
      integer, allocatable :: buried(:)              !! master nodes with the slave on both sides
      !> (3, any) ends of the slave: the node, first and last node of the master edge under it
      integer, allocatable :: ending(:, :)
   end type tie_rows_t

   !> Two surfaces that stay together, whatever their meshes.
   type :: tie_t
      type(origin_t) :: origin
      character(len=:), allocatable :: name
      integer :: slave = 0                           !! index into `scene_t%surface`
      integer :: master = 0
      real(wp) :: tolerance = -1.0_wp                !! POSITION TOLERANCE [L]; < 0: not given
      integer :: multiplier = multiplier_dual
      logical :: is_adjusted = .true.                !! slave nodes are moved onto the master
      type(tie_map_t) :: map                         !! of a cell that repeats itself, or a sector
      type(tie_rows_t) :: rows                       !! frozen before the first step
   end type tie_t

   !> Sum of coefficient times displacement over some degrees of freedom = 0.
   type :: equation_t
      type(origin_t) :: origin
      integer, allocatable :: node(:)                !! (n) the first is the one to eliminate
      integer, allocatable :: dof(:)                 !! (n) 1..n_dim
      real(wp), allocatable :: coefficient(:)        !! (n) the first is not 0
      integer :: first_dof = 0                       !! of the first term, in the deck
      integer :: last_step = huge(1)                 !! that it holds in
      integer :: turned = 0                          !! of a node with axes of its own: its index
   end type equation_t

end module emcon_couplings
