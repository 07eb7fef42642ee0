!> Gaps of nodes over facets before the first step: by them contact of every formulation is judged.
!>
!> Every face counts, also one that does not bear on the node: what is behind at first has no way
!> in. Source: docs/theory.md, section 4.
module emcon_start_gaps
   use emcon_contact, only : gap_state_t
   use emcon_facets, only : facets_length, facets_t, facets_text
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   implicit none
   private
   public :: start_gaps_t, is_slave, is_master

   !> The surfaces of a pair.
   integer, parameter :: is_slave = 1, is_master = 2

   type, abstract :: start_gaps_t
      integer :: n = 0                           !! slave nodes, each once for bodies it looks at
      logical :: is_self = .false.               !! a surface in contact with itself
      logical :: is_closed = .false.             !! what is behind the master is in its body
      type(facets_t) :: surface(is_slave:is_master)
      integer, allocatable :: node(:)            !! (n) node of the scene
      integer, allocatable :: duplicate(:)       !! (n) the other one at its place; 0: none
      integer, allocatable :: place(:)           !! (n) index into the nodes of the slave
      integer, allocatable :: facet(:)           !! (n) nearest of the master; 0: none near
      type(gap_state_t), allocatable :: state(:) !! (n) as last measured
      !> (n) what the facet is off the circle that takes its place: nodes may be behind by it [L]
      real(wp), allocatable :: doubt(:)
   contains
      procedure :: is_connected
      procedure :: other_size
      procedure :: other_text
      procedure(nearest_interface), deferred :: nearest
      procedure(measure_interface), deferred :: measure
      procedure(offset_interface), deferred :: offset
      procedure(faces_interface), deferred :: faces
      procedure(is_sharp_interface), deferred :: is_sharp
      procedure(crossing_interface), deferred :: crossing
   end type start_gaps_t

   abstract interface
      !> Gap of node `i` over the nearest facet of the master, searched among all; `facet(i)` tells
      !> which.
      pure subroutine nearest_interface(self, i, scene, gap, is_over)
         import :: scene_t, start_gaps_t, wp
         class(start_gaps_t), intent(inout) :: self
         integer, intent(in) :: i                !! 1..n
         type(scene_t), intent(in) :: scene
         real(wp), intent(out) :: gap            !! [L]
         logical, intent(out) :: is_over         !! not past an end of the surface
      end subroutine nearest_interface

      !> Fill `facet` and `state`: the gaps of nodes that are near.
      pure subroutine measure_interface(self, scene)
         import :: scene_t, start_gaps_t
         class(start_gaps_t), intent(inout) :: self
         type(scene_t), intent(in) :: scene
      end subroutine measure_interface

      !> The way of node `i` off the place with the gap `gap` in front of its surface, as last
      !> measured, along the normal: without it that is the gap, to first order.
      pure subroutine offset_interface(self, i, scene, gap, offset, is_last)
         import :: scene_t, start_gaps_t, wp
         class(start_gaps_t), intent(inout) :: self
         integer, intent(in) :: i                !! 1..n
         type(scene_t), intent(in) :: scene
         real(wp), intent(in) :: gap             !! that is wanted [L]
         real(wp), intent(out) :: offset(:)      !! (n_dim) [L]
         logical, intent(out) :: is_last         !! it is round-off
      end subroutine offset_interface

      !> Do the slave's surface at node `i` and the facet that is nearest to it face each other?
      pure logical function faces_interface(self, i, scene)
         import :: scene_t, start_gaps_t
         class(start_gaps_t), intent(in) :: self
         integer, intent(in) :: i                !! 1..n
         type(scene_t), intent(in) :: scene
      end function faces_interface

      !> Where does the slave turn by more than `angle` in its nodes, or end? In the reference
      !> configuration.
      pure subroutine is_sharp_interface(self, scene, angle, sharp)
         import :: scene_t, start_gaps_t, wp
         class(start_gaps_t), intent(in) :: self
         type(scene_t), intent(in) :: scene
         real(wp), intent(in) :: angle           !! [degrees]
         logical, intent(out) :: sharp(:)        !! (n)
      end subroutine is_sharp_interface

      !> Two facets in which a surface crosses itself at the start.
      subroutine crossing_interface(self, which, scene, first, second)
         import :: scene_t, start_gaps_t
         class(start_gaps_t), intent(in) :: self
         integer, intent(in) :: which            !! `is_slave` or `is_master`
         type(scene_t), intent(in) :: scene
         integer, intent(out) :: first, second   !! 0, 0: nowhere
      end subroutine crossing_interface
   end interface

contains

   !> Is the facet nearest to node `i` of a surface in contact with itself connected with the node?
   pure logical function is_connected(self, i)
      class(start_gaps_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n

      associate (slave => self%surface(is_slave))
         associate (own => slave%around(slave%around_start(self%place(i))))
            is_connected = slave%part(own) == slave%part(self%facet(i))
         end associate
      end associate
   end function is_connected

   !> How large what the master has at node `i` is [L].
   pure real(wp) function other_size(self, i)
      class(start_gaps_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n

      other_size = facets_length(self%surface(is_master), self%facet(i))
   end function other_size

   !> What the master has at node `i`, for a message.
   subroutine other_text(self, i, scene, text)
      class(start_gaps_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n
      type(scene_t), intent(in) :: scene
      character(len=:), allocatable, intent(out) :: text     !! no line ends

      call facets_text(self%surface(is_master), scene, self%facet(i), text)
   end subroutine other_text

end module emcon_start_gaps
