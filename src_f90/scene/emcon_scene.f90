!> The scene: all that a deck says, as plain data. Nothing here computes.
!>
!> Nodes, elements and so on are numbered 1..n in the order of the deck; the user's numbers are
!> kept as labels. Units are the user's own, consistent: length [L], mass [M], time [T].
module emcon_scene
   use emcon_amplitudes, only : amplitude_t
   use emcon_couplings, only : equation_t, tie_t
   use emcon_element_kind, only : element_kind_t
   use emcon_interactions, only : contact_pair_t
   use emcon_kinds, only : wp
   use emcon_materials, only : material_t, section_t
   use emcon_mesh, only : named_set_t, surface_t
   use emcon_origin, only : origin_t
   use emcon_rigid_bodies, only : rigid_body_t
   use emcon_steps, only : step_t
   use emcon_text, only : string_t, to_text
   implicit none
   private
   public :: scene_t, scene_of_nodes, where_text

   type :: scene_t
      logical :: is_hosted = .false.                 !! a host code's nodes: it computes its solids
      type(string_t), allocatable :: file(:)         !! names of the deck files
      character(len=:), allocatable :: heading
      integer :: n_dim = 2
      logical :: is_axial = .false.                  !! solids of revolution: x is the radius
      integer, allocatable :: node_label(:)          !! (n_node)
      type(origin_t), allocatable :: node_origin(:)  !! (n_node)
      real(wp), allocatable :: x(:, :)               !! (n_dim, n_node) reference positions [L]
      integer, allocatable :: element_label(:)       !! (n_element)
      type(origin_t), allocatable :: element_origin(:)
      type(element_kind_t), allocatable :: kind(:)   !! known to the deck
      integer, allocatable :: element_kind(:)        !! (n_element) index into `kind`
      integer, allocatable :: element_node(:, :)     !! (n_most, n_element) behind the last one, or
                                                     !! where it is wrong, 0
      integer, allocatable :: element_section(:)     !! (n_element)
      type(named_set_t), allocatable :: node_set(:)
      type(named_set_t), allocatable :: element_set(:)
      type(surface_t), allocatable :: surface(:)
      type(material_t), allocatable :: material(:)
      type(section_t), allocatable :: section(:)
      type(amplitude_t), allocatable :: amplitude(:)
      type(contact_pair_t), allocatable :: pair(:)
      type(contact_pair_t), allocatable :: guard(:)  !! of the pairs: emcon_guards
      type(tie_t), allocatable :: tie(:)
      type(equation_t), allocatable :: equation(:)
      type(rigid_body_t), allocatable :: rigid(:)
      type(origin_t) :: given_origin
      integer, allocatable :: given_node(:)          !! ascending: what these do comes from outside
      real(wp), allocatable :: u0(:, :)              !! (n_dim, n_node) initial displacement [L]
      real(wp), allocatable :: v0(:, :)              !! (n_dim, n_node) initial velocity [L/T]
      type(step_t), allocatable :: step(:)
   end type scene_t

contains

   !> Nodes with the labels 1 and on, one step, and nothing else.
   pure subroutine scene_of_nodes(scene, x)
      type(scene_t), intent(out) :: scene
      real(wp), intent(in) :: x(:, :)                !! (n_dim, n_node) reference positions [L]
      integer :: i

      scene%heading = ""
      allocate(scene%x, source=x)
      allocate(scene%u0(size(x, 1), size(x, 2)), scene%v0(size(x, 1), size(x, 2)), source=0.0_wp)
      allocate(scene%node_label, source=[(i, i = 1, size(x, 2))])
      allocate(scene%file(0), scene%node_origin(size(x, 2)), scene%element_origin(0))
      allocate(scene%element_label(0), scene%element_kind(0), scene%element_section(0))
      allocate(scene%element_node(size(x, 1), 0), scene%kind(0))     ! room for a facet
      allocate(scene%node_set(0), scene%element_set(0), scene%surface(0), scene%amplitude(0))
      allocate(scene%material(0), scene%section(0), scene%pair(0), scene%tie(0))
      allocate(scene%equation(0), scene%rigid(0), scene%step(1))
      allocate(scene%step(1)%prescribed(0), scene%step(1)%turn(0), scene%step(1)%load(0), &
         scene%step(1)%output(0))
   end subroutine scene_of_nodes

   !> "file:line" of `origin`, for messages.
   pure function where_text(scene, origin) result(text)
      type(scene_t), intent(in) :: scene
      type(origin_t), intent(in) :: origin
      character(len=where_length(scene, origin)) :: text

      text = "(no deck)"
      if (origin%file > 0) text = scene%file(origin%file)%text // ":" // to_text(origin%line)
   end function where_text

   pure integer function where_length(scene, origin)
      type(scene_t), intent(in) :: scene
      type(origin_t), intent(in) :: origin

      where_length = len("(no deck)")
      if (origin%file > 0) where_length = len(scene%file(origin%file)%text) + 1 &
         + len(to_text(origin%line))
   end function where_length

end module emcon_scene
